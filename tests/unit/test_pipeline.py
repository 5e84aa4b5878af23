"""The main job around an engine that knows the answer: files, report, statuses, atomicity."""

from __future__ import annotations

import json

import fakes
import numpy as np
import pytest
import sphereflow
import sphereflow.pipeline
from sphereflow.pipeline import run

EXACT = 1e-6
"""The trajectory is written with nine digits."""


@pytest.fixture(autouse=True)
def known(known_answers):
    return known_answers


def test_run_of_a_recording_writes_every_file(tmp_path):
    result = run(fakes.FakeRecording(), tmp_path / "out")
    names = sorted(p.relative_to(result.folder).as_posix() for p in result.folder.rglob("*.*"))
    assert names == [
        "calibration.toml",
        "graph.g2o",
        "keyframes.tum",
        "map.ply",
        "odometry.tum",
        "pictures/depth.png",
        "pictures/error.png",
        "pictures/map.png",
        "pictures/trajectory.png",
        "pictures/velocities.png",
        "report.json",
        "segments/000.tum",
        "trajectory.tum",
    ]
    assert [p.name for p in tmp_path.iterdir()] == ["out"]
    assert result.covered
    assert result.coverage == 1.0
    assert result.ape.statistics.rmse < EXACT
    written = sphereflow.Trajectory.read(result.folder / "trajectory.tum")
    assert np.array_equal(written.stamp_ns, fakes.stamps(60))


def test_run_report_counts_what_became_of_every_frame(tmp_path, known):
    known.lost = (20, 21, 30)
    recording = fakes.FakeRecording(bad=(7,), blind=(11, 12), warnings=["a line was skipped"])
    result = run(recording, tmp_path / "out", pictures=False)
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report == json.loads(json.dumps(result.report))
    outcomes = report["outcomes"]
    counts = {name: outcome["frames"] for name, outcome in outcomes.items()}
    assert counts == {
        "started": 1,
        "tracked": 53,
        "weak": 0,
        "coasting": 0,
        "lost": 5,
        "relocalised": 0,
        "skipped": 0,
        "unreadable": 1,
    }
    reasons = {reason["first"]: reason["frames"] for reason in outcomes["lost"]["reasons"]}
    assert reasons == {
        "the frame has no depth image": 2,
        "20 usable domains, 8 needed": 3,
    }
    assert "depth/7.png: 17 bytes" in outcomes["unreadable"]["reasons"][0]["first"]
    assert report["frames"] == 60
    assert report["frames_with_depth"] == 57
    assert report["coverage"] == pytest.approx(54 / 60)
    assert report["warnings"] == {"count": 1, "texts": ["a line was skipped"]}
    codes = [reason["code"] for reason in outcomes["lost"]["reasons"]]
    assert codes == ["no_depth", "few_domains"]
    assert set(report["seconds"]) == {"decode", "engine", "compare", "evaluate", "write"}
    assert report["front_ms_per_frame"] == pytest.approx({"pyramid": 0.5, "solve": 1.5})
    assert report["timing"]["rate_hz"] == pytest.approx(1e9 / fakes.STEP_NS)
    assert report["timing"]["gaps"]["count"] == 0
    assert report["peak_memory_bytes"] > 1_000_000
    assert report["truth"]["ape"]["pairs"] == 54


def test_run_writes_no_pose_for_a_lost_frame(tmp_path, known):
    known.lost = (5, 6)
    result = run(fakes.FakeRecording(20), tmp_path / "out", pictures=False)
    written = sphereflow.Trajectory.read(result.folder / "trajectory.tum")
    assert len(written) == 18
    assert not set(fakes.stamps(20)[[5, 6]]) & set(np.asarray(written.stamp_ns).tolist())
    assert result.coverage == 0.9
    assert result.covered


def test_run_without_any_pose_is_not_covered_and_writes_no_trajectory(tmp_path, known):
    known.lost = tuple(range(10))
    result = run(fakes.FakeRecording(10), tmp_path / "out")
    assert not result.covered
    assert result.trajectory is None
    assert not (result.folder / "trajectory.tum").exists()
    assert result.report["truth"] == {"ape": "no frame has a pose"}


def test_run_stops_at_max_frames(tmp_path):
    seen = []
    run(
        fakes.FakeRecording(60),
        tmp_path / "out",
        max_frames=12,
        pictures=False,
        progress=lambda *told: seen.append(told),
    )
    assert seen[11] == ("track", 12, 12)
    assert seen[-1] == ("compare", 2, 2)


def test_run_into_a_full_folder_is_refused_and_changes_nothing(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.doc").write_text("years of work")
    with pytest.raises(sphereflow.DataError, match="is not empty"):
        run(fakes.FakeRecording(), tmp_path / "out")
    with pytest.raises(sphereflow.DataError, match="is no result of an earlier run"):
        run(fakes.FakeRecording(), tmp_path / "out", overwrite=True)
    assert (tmp_path / "out" / "thesis.doc").read_text() == "years of work"


def test_run_with_overwrite_replaces_an_earlier_result(tmp_path):
    run(fakes.FakeRecording(30), tmp_path / "out")
    result = run(fakes.FakeRecording(12), tmp_path / "out", overwrite=True, pictures=False)
    assert result.report["frames"] == 12
    assert not (tmp_path / "out" / "pictures").exists()
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


def test_run_that_fails_leaves_nothing_behind(tmp_path, known, monkeypatch):
    def broken(self, frame):
        raise RuntimeError("a defect")

    monkeypatch.setattr(known, "push_frame", broken)
    with pytest.raises(RuntimeError):
        run(fakes.FakeRecording(), tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"method": "magic"}, "method must be one of depth"),
        ({"max_frames": 0}, "max_frames"),
        ({"min_coverage": 1.5}, "min_coverage"),
        ({"voxel_m": 0.0}, "voxel_m"),
    ],
)
def test_run_with_an_impossible_option_is_an_error(tmp_path, options, text):
    with pytest.raises(sphereflow.ValueRangeError, match=text):
        run(fakes.FakeRecording(), tmp_path / "out", **options)


def test_run_without_matplotlib_says_so_in_the_report(tmp_path, monkeypatch):
    import builtins

    real = builtins.__import__

    def without(name, *rest, **kwargs):
        if name.startswith("matplotlib"):
            raise ImportError(name)
        return real(name, *rest, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without)
    result = run(fakes.FakeRecording(10), tmp_path / "out")
    assert 'pip install "sphereflow[plot]"' in result.report["warnings"]["texts"][0]


def test_run_records_for_the_viewer_a_file_that_opens(tmp_path):
    pytest.importorskip("rerun")
    from sphereflow.viz import rows_by_entity

    run(fakes.FakeRecording(45), tmp_path / "out", rrd=tmp_path / "out" / "run.rrd", pictures=False)
    rows = rows_by_entity(tmp_path / "out" / "run.rrd")
    for axis in "xyz":
        assert rows[f"/motion/linear_m_s/{axis}"] == 45
    assert rows["/motion/quality"] == rows["/log/status"] == 45
    assert rows["/world/camera/depth"] == rows["/world/camera/colour"] == 15
    assert rows["/world/path"] == rows["/world/truth"] == 1
    assert rows["/world/map"] >= 1
    assert list(tmp_path.iterdir()) == [tmp_path / "out"]


def test_run_recording_outside_the_result_is_removed_when_the_run_fails(
    tmp_path, known, monkeypatch
):
    pytest.importorskip("rerun")

    def broken(self, frame):
        raise RuntimeError("a defect")

    monkeypatch.setattr(known, "push_frame", broken)
    with pytest.raises(RuntimeError):
        run(fakes.FakeRecording(), tmp_path / "out", rrd=tmp_path / "run.rrd")
    assert list(tmp_path.iterdir()) == []


def test_run_of_a_recording_that_breaks_off_does_not_cover_the_rest(tmp_path):
    result = run(fakes.FakeRecording(40, ends=30), tmp_path / "out", pictures=False)
    assert result.coverage == 0.75
    assert not result.covered
    unreadable = result.report["outcomes"]["unreadable"]
    assert unreadable["frames"] == 10
    assert "ended before" in unreadable["reasons"][0]["first"]


def test_run_corrects_the_trajectory_and_keeps_what_was_measured(tmp_path, known):
    known.drift_m = 0.002
    seen = []
    result = run(
        fakes.FakeRecording(60),
        tmp_path / "out",
        pictures=False,
        progress=lambda *told: seen.append(told),
    )
    corrected = sphereflow.Trajectory.read(result.folder / "trajectory.tum")
    measured = sphereflow.Trajectory.read(result.folder / "odometry.tum")
    assert np.array_equal(corrected.stamp_ns, measured.stamp_ns)
    apart = np.asarray(measured.position_m) - np.asarray(corrected.position_m)
    np.testing.assert_allclose(apart[:, 1], 0.002 * np.arange(60), atol=EXACT)
    report = result.report
    assert report["schema"] == 3
    assert report["pose_graph"] == {
        "keyframes": 6,
        "edges": 12,
        "rejected": 1,
        "failed": 0,
        "converged": True,
        "interrupted": False,
        "largest_change_m": pytest.approx(0.118),
    }
    assert report["no_pose_graph_because"] is None
    assert report["warnings"]["count"] == 0
    assert set(report["truth"]) == {
        f"{whose}{error}"
        for whose in ("", "odometry_")
        for error in ("ape", "rpe_1s_translation", "rpe_1s_rotation")
    }
    assert result.ape.statistics.rmse < EXACT < result.odometry_ape.statistics.rmse
    assert seen[-1] == ("compare", 6, 6)


def test_run_without_pose_graph_says_so_and_writes_one_trajectory_twice(tmp_path, known):
    known.drift_m = 0.002
    result = run(fakes.FakeRecording(60), tmp_path / "out", pictures=False, pose_graph=False)
    files = [result.folder / name for name in ("trajectory.tum", "odometry.tum")]
    assert files[0].read_bytes() == files[1].read_bytes()
    assert result.report["pose_graph"] is None
    assert result.report["no_pose_graph_because"] == "not asked for"
    truth = result.report["truth"]
    assert truth["ape"] == truth["odometry_ape"]
    assert known.made[-1].graph is None


def test_run_with_one_keyframe_has_nothing_to_compare(tmp_path):
    report = run(fakes.FakeRecording(8), tmp_path / "out", pictures=False).report
    assert report["pose_graph"] is None
    assert report["no_pose_graph_because"] == "1 keyframe: nothing to compare"


def test_run_whose_pose_graph_did_not_settle_warns(tmp_path, known):
    known.converged = False
    report = run(fakes.FakeRecording(60), tmp_path / "out", pictures=False).report
    assert report["pose_graph"]["converged"] is False
    assert "did not settle" in report["warnings"]["texts"][0]


@pytest.mark.parametrize(
    ("calibrated", "given", "used", "source"),
    [
        (None, None, 0.0, "unknown"),
        (0.02, None, 0.02, "recording"),
        (0.02, 0.0, 0.0, "given"),
        (None, 0.03, 0.03, "given"),
    ],
)
def test_run_takes_the_readout_given_or_else_the_recordings(
    tmp_path, known, calibrated, given, used, source
):
    recording = fakes.FakeRecording(12, readout_s=calibrated, depth_corrected=True)
    report = run(recording, tmp_path / "out", pictures=False, readout_s=given).report
    assert known.made[-1].calibration.readout_s == report["readout_s"] == used
    assert report["readout_source"].startswith(source)
    assert report["depth_corrected"] is True
    # Nothing of a calibrated depth's error grows with the motion.
    assert known.made[-1].config.odometry.alignment.covariance.motion_share == 0.0
    assert report["settings"]["readout_s"] == given
    assert report["calibration"]["readout_s"] == calibrated


def test_run_of_a_recording_without_readout_and_correction_takes_none(tmp_path, known):
    whole = fakes.FakeRecording(12)

    class Bare:
        def __getattr__(self, name):
            if name in ("readout_s", "depth_corrected"):
                raise AttributeError(name)
            return getattr(whole, name)

        def __len__(self):
            return len(whole)

    report = run(Bare(), tmp_path / "out", pictures=False).report
    assert (report["readout_s"], report["depth_corrected"]) == (0.0, False)


def test_run_with_a_break_names_it_and_writes_each_segment(tmp_path, known):
    known.lost, known.breaks = (20, 21, 22), (23,)
    result = run(fakes.FakeRecording(40), tmp_path / "out", pictures=False)
    report = result.report
    assert [segment["frames"] for segment in report["segments"]] == [20, 17]
    (text,) = report["warnings"]["texts"]
    assert text.startswith("break of 0.13 s at")
    written = [sphereflow.Trajectory.read(result.folder / f"segments/{i:03d}.tum") for i in (0, 1)]
    assert [len(path) for path in written] == [20, 17]
    whole = np.asarray(result.trajectory.stamp_ns)
    assert np.array_equal(np.concatenate([path.stamp_ns for path in written]), whole)


def test_run_of_many_weak_frames_warns(tmp_path, known):
    known.weak = tuple(range(10, 30))
    report = run(fakes.FakeRecording(40), tmp_path / "out", pictures=False).report
    assert report["coverage_weak"] == pytest.approx(0.5)
    assert "50 % of the poses are weak" in report["warnings"]["texts"][0]


def test_run_of_frames_from_anywhere_needs_a_calibration(tmp_path):
    recording = fakes.FakeRecording(20)
    frames = (recording.frame(index) for index in range(20))
    with pytest.raises(sphereflow.DtypeError, match="calibration: expected a sphereflow"):
        run(frames, tmp_path / "a")
    calibration = sphereflow.Calibration(recording.camera)
    result = run(frames, tmp_path / "b", calibration=calibration, pictures=False)
    assert result.report["frames"] == 20
    assert result.coverage == 1.0
    assert sphereflow.Calibration.read(result.folder / "calibration.toml").depth == recording.camera


def test_run_whose_viewer_cannot_write_keeps_the_result_and_says_so(tmp_path, monkeypatch):
    class Full:
        def frame(self, index, frame, motion):
            raise OSError(28, "No space left on device")

        def discard(self):
            pass

    monkeypatch.setattr(sphereflow.pipeline, "_viewer", lambda recording, path: Full())
    rrd = tmp_path / "run.rrd"
    result = run(fakes.FakeRecording(20), tmp_path / "out", pictures=False, rrd=rrd)
    assert result.covered
    assert "No space left" in result.report["warnings"]["texts"][0]
