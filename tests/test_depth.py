"""Optical flow and dense depth from Python: figures, signs, statuses with reasons, named errors."""

import json
from pathlib import Path

import numpy as np
import pytest
import sphereflow as sf
from sphereflow.cli import app
from typer.testing import CliRunner

WIDTH, HEIGHT = 160, 120
CAMERA = sf.Camera.pinhole(171.6, 164.9, 79.5, 59.5, WIDTH, HEIGHT)
MOVING = {"v_m_s": [0.4, 0.0, 0.0], "omega_rad_s": [0.0, 0.0, 0.0], "dt_s": 1 / 60}


def frames(count: int, motion: str = "sinusoids_411") -> list[sf.sim.SimulatedFrame]:
    simulator = sf.sim.Simulator(
        scene="thesis_room", motion=motion, camera=CAMERA, rate_hz=60.0, depth_noise="none"
    )
    return list(simulator.frames(0, count))


def texture(u: float = 0.0, v: float = 0.0) -> np.ndarray:
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(float)
    x, y = x - u, y - v
    return 128 + 50 * np.sin(0.35 * x + 0.1 * y) + 50 * np.sin(0.31 * y - 0.07 * x)


def error_percent(range_m: np.ndarray, frame: sf.sim.SimulatedFrame) -> float:
    return 100 * float(np.mean(np.abs(range_m / frame.exact_range_m - 1)))


def test_tv_l1_of_a_shift_is_that_shift_in_pixels() -> None:
    """Thesis: eq. (2.9). Columns to the right first, rows down second."""
    flow = sf.flow.tv_l1(texture(), texture(2.0, -1.0))
    assert flow.shape == (HEIGHT, WIDTH, 2)
    assert np.abs(flow - [2.0, -1.0]).mean() < 0.1


def test_horn_schunck_of_a_small_shift_is_that_shift() -> None:
    """Thesis: eq. (2.7)."""
    flow = sf.flow.horn_schunck(texture(), texture(0.4, -0.3), solver="sor", sweeps=2000)
    assert np.abs(flow - [0.4, -0.3]).mean() < 0.03


def test_rof_denoise_lowers_noise_and_keeps_the_mean() -> None:
    """Thesis: eq. (2.8)."""
    noisy = 100 + np.random.default_rng(1).normal(0, 5, (40, 50))
    smooth = sf.flow.rof_denoise(noisy)
    assert smooth.std() < 0.3 * noisy.std()
    assert abs(smooth.mean() - noisy.mean()) < 0.05


def test_depth_filter_with_poses_finds_the_room() -> None:
    """Thesis: section 4.1.1, a quarter of its size."""
    depth_filter = sf.depth.DepthFilter(CAMERA, binning=1)
    for frame in frames(60):
        result = depth_filter.step(
            frame.exact_grey,
            world_from_camera=frame.world_from_camera,
            stamp_ns=frame.stamp_ns,
        )
    assert result.status == "updated"
    assert error_percent(result.range_m, frame) < 1.0
    assert result.std_m is not None
    assert result.std_m.shape == (HEIGHT, WIDTH)


def test_depth_filter_with_velocities_finds_the_same() -> None:
    """Thesis: eq. (1.8). The motion is integrated from velocities at the middle of each step."""
    depth_filter = sf.depth.DepthFilter(CAMERA, binning=1)
    previous = None
    for frame in frames(60):
        before = frame if previous is None else previous
        result = depth_filter.step(
            frame.exact_grey,
            v_m_s=0.5 * (frame.linear_m_s + before.linear_m_s),
            omega_rad_s=0.5 * (frame.angular_rad_s + before.angular_rad_s),
            dt_s=1 / 60,
        )
        previous = frame
    assert error_percent(result.range_m, frame) < 1.5


def test_observers_and_variational_depth_work_together() -> None:
    """Thesis: eq. (2.16), (2.20), (3.3), (3.7)."""
    first, second = frames(2)
    motion = {"v_m_s": first.linear_m_s, "omega_rad_s": first.angular_rad_s, "dt_s": 1 / 60}
    images = (first.exact_grey, second.exact_grey)
    sobolev = sf.depth.sobolev_depth(CAMERA, *images, **motion)
    assert sobolev.residual < 1e-3
    variational = sf.depth.tv_l1_depth(CAMERA, *images, **motion)
    assert variational.energy > 0
    by_depth = sf.depth.DepthObserver(CAMERA)
    assert by_depth.step(sobolev.inv_range, **motion).status == "updated"
    by_flow = sf.depth.FlowObserver(CAMERA)
    result = by_flow.step(sf.flow.tv_l1(*images), **motion)
    assert result.status == "updated"
    assert result.std_m is None
    assert np.isfinite(result.range_m).all()


@pytest.mark.parametrize(
    ("image", "motion", "status", "words"),
    [
        (texture(), {"v_m_s": [0, 0, 0], "omega_rad_s": [0, 0, 0]}, "unobservable", "still"),
        (texture(), {"v_m_s": [0, 0, 0], "omega_rad_s": [0, 0.3, 0]}, "unobservable", "turns"),
        (np.zeros((HEIGHT, WIDTH)), {}, "unusable", "texture"),
        (np.full((HEIGHT, WIDTH), 256.0), {}, "unusable", "texture"),
        (np.full((HEIGHT, WIDTH), np.nan), {}, "unusable", "known"),
    ],
)
def test_depth_filter_that_can_see_nothing_says_so(
    image: np.ndarray, motion: dict[str, list[float]], status: str, words: str
) -> None:
    depth_filter = sf.depth.DepthFilter(CAMERA)
    depth_filter.step(texture(), **MOVING)
    result = depth_filter.step(image, **(MOVING | motion))
    assert result.status == status
    assert result.reason is not None
    assert words in result.reason
    assert np.isfinite(result.range_m).all()


def test_depth_filter_of_a_stamp_that_does_not_increase_skips_the_image() -> None:
    depth_filter = sf.depth.DepthFilter(CAMERA)
    pose = np.eye(4)
    depth_filter.step(texture(), world_from_camera=pose, stamp_ns=5)
    result = depth_filter.step(texture(), world_from_camera=pose, stamp_ns=5)
    assert result.status == "skipped"
    assert result.reason == "the stamp does not increase"


def test_depth_filter_of_bad_input_names_it() -> None:
    depth_filter = sf.depth.DepthFilter(CAMERA)
    broken = np.eye(4)
    broken[0, 3] = np.nan
    with pytest.raises(sf.ShapeError, match="image"):
        depth_filter.step(np.zeros((10, 10)), **MOVING)
    with pytest.raises(sf.ValueRangeError, match="pose"):
        depth_filter.step(texture(), world_from_camera=broken, stamp_ns=0)
    with pytest.raises(sf.ValueRangeError, match="v_m_s"):
        depth_filter.step(texture(), **(MOVING | {"v_m_s": [np.nan, 0, 0]}))
    with pytest.raises(sf.ValueRangeError, match="dt_s"):
        depth_filter.step(texture(), **(MOVING | {"dt_s": 0.0}))
    with pytest.raises(sf.ValueRangeError, match="step"):
        depth_filter.step(texture(), stamp_ns=0)
    with pytest.raises(sf.ValueRangeError, match="binning"):
        sf.depth.DepthFilter(CAMERA, binning=9)


def test_flow_of_bad_input_names_it() -> None:
    with pytest.raises(sf.ShapeError, match="image1"):
        sf.flow.tv_l1(texture(), texture()[1:])
    with pytest.raises(sf.ValueRangeError, match="alpha"):
        sf.flow.horn_schunck(texture(), texture(), alpha=-1.0)
    with pytest.raises(sf.ValueRangeError, match="solver"):
        sf.flow.horn_schunck(texture(), texture(), solver="magic")  # type: ignore[arg-type]


def test_depth_command_writes_depth_images_and_an_error_table(tmp_path: Path) -> None:
    data, out = tmp_path / "room", tmp_path / "depth"
    run = CliRunner().invoke
    options = ["--scene", "thesis_room", "--motion", "sinusoids_411", "--depth-noise", "none"]
    made = run(app, ["sim", "--out", str(data), "--duration", "0.5", "--rate", "60", *options])
    assert made.exit_code == 0, made.output
    poses = data / "groundtruth.txt"
    result = run(app, ["depth", str(data), "--poses", str(poses), "--out", str(out)])
    assert result.exit_code == 0, result.output + result.stderr
    report = json.loads((out / "report.json").read_text())
    assert report["statuses"]["updated"] > 20
    assert report["error"]["median_percent"] < 2.0
    assert len(list((out / "depth" / "depth").glob("*.png"))) == report["frames"]
    assert (out / "errors.csv").read_text().startswith("stamp_ns,status,reason")
