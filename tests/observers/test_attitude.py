"""Attitude on the BROAD benchmark, beside what is published, and its Python face."""

from pathlib import Path

import numpy as np
import pytest
import sphereflow as sf
from sphereflow.attitude import AttitudeFilter, VisualAttitude


def quaternion_product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Hamilton product of (N, 4) arrays, w first."""
    aw, ax, ay, az = a.T
    bw, bx, by, bz = b.T
    return np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        1,
    )


def total_rmse_deg(quat_xyzw: np.ndarray, trial: dict) -> float:
    """Root mean square of the whole angle over the samples that count."""
    conjugate = trial["opt_quat"] * np.array([1.0, -1.0, -1.0, -1.0])
    error = quaternion_product(quat_xyzw[:, [3, 0, 1, 2]], conjugate)
    counts = (trial["movement"] == 1) & np.isfinite(error).all(1)
    angle = 2 * np.arccos(np.clip(np.abs(error[counts, 0]), 0, 1))
    return float(np.degrees(np.sqrt(np.mean(angle**2))))


def test_broad_is_better_than_the_published_madgwick_and_mahony(recordings: Path) -> None:
    scipy_io = pytest.importorskip("scipy.io")
    import csv

    with (recordings / "broad-a" / "published_rmse.csv").open() as file:
        published = list(csv.DictReader(file))
    ours, best = [], []
    for path in sorted((recordings / "broad-a").glob("*.mat")):
        trial = scipy_io.loadmat(path, squeeze_me=True)
        count = len(trial["imu_gyr"])
        stamp_ns = np.round(np.arange(count) / trial["sampling_rate"] * 1e9).astype(np.int64)
        run = AttitudeFilter().run(trial["imu_gyr"], trial["imu_acc"], trial["imu_mag"], stamp_ns)
        ours.append(total_rmse_deg(run.quat_xyzw, trial))
        rows = [row for row in published if row["trial"] == path.stem]
        best.append(min(float(row["total_rmse_deg_best"]) for row in rows))
        print(f"{path.stem}: {ours[-1]:.2f} deg, best published {best[-1]:.2f} deg")
    assert len(ours) == 8
    assert np.mean(ours) < 2.03  # vqf in its real-time form on the same data
    assert all(a < b for a, b in zip(ours, best, strict=True))


def test_run_names_the_argument_of_the_wrong_shape() -> None:
    stamps = np.arange(10) * 5_000_000
    with pytest.raises(sf.ShapeError, match="accel"):
        AttitudeFilter().run(np.zeros((10, 3)), np.zeros((9, 3)), None, stamps)
    with pytest.raises(sf.ValueRangeError, match="method"):
        AttitudeFilter(method="magic")  # type: ignore[arg-type]


def test_step_and_run_agree_and_are_unit() -> None:
    rng = np.random.default_rng(1)
    gyro, accel = rng.normal(size=(200, 3)), rng.normal(size=(200, 3)) + np.array([0, 0, 9.81])
    run = AttitudeFilter().run(gyro, accel, None, np.arange(200) * 5_000_000)
    single = AttitudeFilter()
    for g, a in zip(gyro, accel, strict=True):
        state = single.step(g, a, dt_s=0.005)
    np.testing.assert_allclose(run.quat_xyzw[-1], state.quat_xyzw, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(run.quat_xyzw, axis=1), 1, atol=1e-12)
    assert state.status == "starting"


def test_visual_attitude_follows_vision_whatever_its_sign() -> None:
    observer = VisualAttitude(gain_per_s=2.0)
    assert observer.quat_xyzw is None
    for i in range(400):
        sign = 1 if i % 2 else -1
        observer.step([0, 0, 0], sign * np.array([0.0, 0.0, 0.0, 1.0]), dt_s=0.01)
    assert abs(abs(observer.quat_xyzw[3]) - 1) < 1e-12
