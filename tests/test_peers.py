"""The comparison with other people's odometry: our rows run, an absent peer is said to be."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
import sphereflow as sf

sys.path.insert(0, str(Path(__file__).parents[1]))

from benches.peers import motion, results, run, table, undistort
from benches.peers.align import Aligned, View
from benches.peers.tracking import FrameToFrame, FrameToKeyframe, plausible


def rows_of(folder: Path) -> dict[tuple[str, str], results.Result]:
    return {(r.data, r.name): r for r in results.read(folder / "peers.json")}


def test_peers_command_runs_our_rows_on_two_pairs(tmp_path: Path) -> None:
    data = ["--pairs", "2", "--noise", "independent", "--tour", "1", "--recordings"]
    rows = ["--only", "single", "16, 8, 4", "at rest"]
    assert run.main([*data, *rows, "--out", str(tmp_path)]) == 0
    found = rows_of(tmp_path)
    rest = found["independent, 133 ms", "at rest"].figures
    for name in ("ours, single", "point-wise 16, 8, 4"):
        figures = found["independent, 133 ms", name].figures
        assert figures["covered"] == 2
        assert figures["ev_m_s"] < 0.1 * rest["ev_m_s"]
        assert figures["ew_rad_s"] < 0.1 * rest["ew_rad_s"]
        assert figures["cpu_ms"] > 0.0
    text = (tmp_path / "peers.md").read_text()
    assert "independent noise" in text
    assert "| point-wise 16, 8, 4 |" in text


def test_peers_absent_package_is_reported_with_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    package = table.Package("no_such_odometry", "no-such-odometry>=1")
    absent = table.Row("absent peer", "opencv_rows:OpencvOdometry", needs=package)
    monkeypatch.setattr(run, "ROWS", (absent,))
    data = ["--pairs", "1", "--noise", "kinect", "--tour", "1", "--recordings"]
    assert run.main([*data, "--out", str(tmp_path)]) == 0
    result = rows_of(tmp_path)["kinect, 33 ms", "absent peer"]
    assert result.status == "not installed"
    assert result.figures == {}
    shown = capsys.readouterr().out
    assert "| absent peer | not installed |" in shown
    assert "pip install 'no-such-odometry>=1'" in shown


def test_peers_option_that_the_build_has_not_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    row = table.Row("ours, magic", "ours:WeakForm", {"method": "magic"})
    result = run.measure(row, "pairs", "none", "pair")
    assert result.status == "not in this build"
    assert "magic" in (result.reason or "")


def test_peers_row_that_breaks_is_failed_with_its_last_words() -> None:
    package = table.Package("json", "part of Python")
    row = table.Row("broken", "ours:NoSuchClass", needs=package)
    job = {"folder": "nowhere", "noise": "kinect", "gap": 1}
    result = run.measure(row, "pairs", "kinect, 33 ms", "pair", job=job, budget_s=10.0)
    assert result.status == "failed"
    assert "NoSuchClass" in (result.reason or "")


def test_peers_merge_keeps_what_is_not_measured_again(tmp_path: Path) -> None:
    def result(name: str, status: str, value: float) -> results.Result:
        return results.Result(
            "pairs", "kinect, 33 ms", "pair", name, False, status, None, {"x": value}
        )

    old = [result("a", "measured", 1.0), result("b", "measured", 2.0)]
    results.write(tmp_path / "old.json", old)
    new = [result("a", "measured", 3.0), result("b", "not installed", 4.0)]
    found = results.merged(results.read(tmp_path / "old.json"), new)
    assert [(r.name, r.figures["x"]) for r in found] == [("a", 3.0), ("b", 2.0)]
    (tmp_path / "old.json").write_text(json.dumps({"format": 0}))
    with pytest.raises(SystemExit, match="format"):
        results.read(tmp_path / "old.json")


def test_motion_of_twist_and_back_is_the_same() -> None:
    random = np.random.default_rng(1)
    for size in (1e-9, 1e-3, 1.0):
        v, w = random.normal(size=3), size * random.normal(size=3)
        back_v, back_w = motion.twist_of(motion.motion_of(v, w, 0.5), 0.5)
        # rounding of an arc tangent and of a 3x3 solve
        np.testing.assert_allclose(back_v, v, atol=1e-9)
        np.testing.assert_allclose(back_w, w, atol=1e-9)


def test_undistorted_depth_of_a_wall_is_the_wall() -> None:
    camera = sf.Camera.opencv(260, 260, 159.5, 119.5, 320, 240, k1=0.2, k2=-0.3)
    undistorted = undistort.Undistorted(camera)
    ys, xs = np.mgrid[0:240, 0:320].reshape(2, -1).astype(float)
    pixels = np.stack([xs, ys], axis=1)
    # The plane 0.3 x + z = 2: depth along the axis is 2 / (0.3 x/z + 1).
    distorted = camera.unproject(pixels)
    wall = (2.0 / (0.3 * distorted[:, 0] / distorted[:, 2] + 1.0)).astype(np.float32)
    colour = np.full((240, 320, 3), 77, np.uint8)
    found = undistorted(View(wall.reshape(240, 320), colour))
    rays = undistorted.camera.unproject(pixels)
    expected = (2.0 / (0.3 * rays[:, 0] / rays[:, 2] + 1.0)).reshape(240, 320)
    inside = np.isfinite(found.depth_m)
    assert inside.mean() > 0.9
    # half a pixel of the slope
    assert np.abs(found.depth_m - expected)[inside].max() < 2e-3
    assert found.colour is not None
    assert (found.colour[inside] == 77).all()


class Knowing:
    """An aligner that knows the answer: frames carry their number as depth."""

    def __init__(self, poses: list[np.ndarray], fails: set[tuple[int, int]] = frozenset()):
        self.poses, self.fails = poses, fails

    def prepare(self, view: View) -> int:
        return round(float(view.depth_m[0, 0])) - 1

    def align(self, first: int, second: int, dt_s: float, guess: np.ndarray) -> Aligned:
        if (first, second) in self.fails:
            return Aligned(None, "told to fail")
        return Aligned(motion.inverse(self.poses[first]) @ self.poses[second])


CAMERA = sf.Camera.pinhole(100.0, 100.0, 63.5, 47.5, 128, 96)


@pytest.mark.parametrize("driver", [FrameToFrame, FrameToKeyframe])
def test_driver_chains_exact_motions_into_the_trajectory(driver: type[FrameToFrame]) -> None:
    step = motion.motion_of(np.array([0.3, 0.0, 0.1]), np.array([0.0, 0.8, 0.2]), 1 / 30)
    poses = [np.eye(4)]
    for _ in range(30):
        poses.append(poses[-1] @ step)
    tracker = driver(Knowing(poses), CAMERA)
    for i, pose in enumerate(poses):
        view = View(np.full((96, 128), i + 1.0, np.float32), None)
        found = tracker.push(view, round(i * 1e9 / 30))
        assert not found.lost
        np.testing.assert_allclose(found.world_from_camera, pose, atol=1e-12)


@pytest.mark.parametrize("driver", [FrameToFrame, FrameToKeyframe])
def test_driver_predicts_a_lost_frame_and_says_so(driver: type[FrameToFrame]) -> None:
    step = motion.motion_of(np.array([0.3, 0.0, 0.1]), np.array([0.0, 0.3, 0.2]), 1 / 30)
    poses = [np.eye(4)]
    for _ in range(6):
        poses.append(poses[-1] @ step)
    tracker = driver(Knowing(poses, {(k, 4) for k in range(4)}), CAMERA)
    for i, pose in enumerate(poses):
        view = View(np.full((96, 128), i + 1.0, np.float32), None)
        found = tracker.push(view, round(i * 1e9 / 30))
        assert found.lost == (i == 4)
        # constant velocity predicts this motion exactly
        np.testing.assert_allclose(found.world_from_camera, pose, atol=1e-12)


class RunsAway(Knowing):
    """Aligns with the frame before only; with older ones it is 10 cm off."""

    def align(self, first: int, second: int, dt_s: float, guess: np.ndarray) -> Aligned:
        found = super().align(first, second, dt_s, guess).first_from_second
        assert found is not None
        if second - first > 1:
            found = found.copy()
            found[0, 3] += 0.1
        return Aligned(found)


def test_keyframe_driver_falls_back_on_the_frame_before() -> None:
    step = motion.motion_of(np.array([0.3, 0.0, 0.1]), np.array([0.0, 0.3, 0.2]), 1 / 30)
    poses = [np.eye(4)]
    for _ in range(6):
        poses.append(poses[-1] @ step)
    tracker = FrameToKeyframe(RunsAway(poses), CAMERA)
    for i, pose in enumerate(poses):
        view = View(np.full((96, 128), i + 1.0, np.float32), None)
        found = tracker.push(view, round(i * 1e9 / 30))
        assert not found.lost
        np.testing.assert_allclose(found.world_from_camera, pose, atol=1e-12)


def test_driver_refuses_what_no_hand_does() -> None:
    far = np.eye(4)
    far[0, 3] = 1.0
    assert plausible(Aligned(far), 1.0).reason is None
    assert plausible(Aligned(far), 0.03).reason == "implausible motion"
