"""Gyro bias from real images: a camera turned by hand, its gyro simulated from the truth."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import sphereflow as sf
from sphereflow.observers import VelocityBiasEstimator, calibrate_camera_imu

GYRO_SIGMA = 2.5e-3
BIAS = np.array([0.010, -0.008, 0.012])
READOUT_S = 0.03  # of a Kinect


def conjugate_product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a* b of quaternions x, y, z, w."""
    x, y, z, w = a
    return np.array([[w, z, -y, -x], [-z, w, x, -y], [y, -x, w, -z], [x, y, z, w]]) @ b


def attitude_at(truth: sf.Trajectory, stamp_ns: int) -> np.ndarray | None:
    """Attitude between two truths, linear in the quaternion."""
    i = int(np.searchsorted(truth.stamp_ns, stamp_ns))
    if i == 0 or i == len(truth.stamp_ns) or truth.stamp_ns[i] - truth.stamp_ns[i - 1] > 5e7:
        return None
    a, b = truth.quat_xyzw[i - 1], truth.quat_xyzw[i]
    share = (stamp_ns - truth.stamp_ns[i - 1]) / (truth.stamp_ns[i] - truth.stamp_ns[i - 1])
    q = (1 - share) * a + share * (b if a @ b > 0 else -b)
    return q / np.linalg.norm(q)


def rates(stamp_ns: np.ndarray, quat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stamps half way between attitudes, and the angular velocities there, body frame."""
    keep = np.r_[True, np.diff(stamp_ns) > 0]
    stamp_ns, quat = stamp_ns[keep], quat[keep]
    turns = np.array([conjugate_product(a, b) for a, b in pairwise(quat)])
    seconds = np.diff(stamp_ns)[:, None] * 1e-9
    return stamp_ns[:-1] // 2 + stamp_ns[1:] // 2, 2 * turns[:, :3] * np.sign(
        turns[:, 3:]
    ) / seconds


def clock_offset_ns(recording: sf.io.Recording) -> int:
    """How much earlier than a frame's stamp the gyro's clock was, from the turns of both."""
    engine = sf.Engine(sf.Calibration(recording.camera, readout_s=READOUT_S))
    for frame in recording.frames():
        if frame.depth_m is not None:
            engine.push(frame)
    seen = engine.trajectory("causal")
    truth = recording.truth
    camera_ns, camera = rates(seen.stamp_ns, seen.quat_xyzw)
    gyro_ns, gyro = rates(truth.stamp_ns, truth.quat_xyzw)
    found = calibrate_camera_imu(camera, camera_ns, gyro + BIAS, gyro_ns)
    assert found["status"] == "ok"
    print(f"clocks: {1e3 * found['time_offset_s']:.1f} ms apart")
    return round(-1e9 * found["time_offset_s"])


Frame = tuple[int, np.ndarray, np.ndarray]
"""Stamp, brightness, depth."""


def bias_error(
    recording: sf.io.Recording, frames: list[Frame], apart_ns: int, seed: int
) -> tuple[float, float]:
    """Error of the gyro's bias after ten seconds, rad/s; its square in units of the covariance."""
    rng = np.random.default_rng(seed)
    estimator = VelocityBiasEstimator(
        recording.camera,
        forget_s=100.0,  # the bias is constant
        angular_sigma=GYRO_SIGMA / np.sqrt(6),
        angular_bias_sigma=0.05,
        readout_s=READOUT_S,
        timing_sigma_s=0.01,  # stamps are those of arrival
    )
    before, last_ns, first_ns = None, 0, None
    for stamp_ns, grey, depth_m in frames:
        attitude = attitude_at(recording.truth, stamp_ns - apart_ns)
        if attitude is None:
            before = None
            continue
        first_ns = first_ns or stamp_ns
        if stamp_ns - first_ns > 10e9:
            break
        if before is not None:
            dt_s = (stamp_ns - last_ns) * 1e-9
            turn = conjugate_product(before, attitude)
            rate = 2 * turn[:3] * np.sign(turn[3]) / dt_s
            # Six readings of the gyro between two frames.
            gyro = rate + BIAS + rng.normal(scale=GYRO_SIGMA / np.sqrt(6), size=3)
            estimator.step(grey, depth_m, gyro, dt_s=dt_s)
        before, last_ns = attitude, stamp_ns
    state = estimator.state
    error = state.angular_rad_s - BIAS
    share = error @ np.linalg.solve(state.covariance[:3, :3], error) / 3
    return float(np.linalg.norm(error)), float(share)


def test_gyro_bias_of_a_turning_kinect_is_found_within_ten_seconds(recordings: Path) -> None:
    # Thesis: section 5.4.4: rotations only; here the linear velocity is left unknown instead.
    # What limits it: images of a camera that turns at 3 rad/s are blurred and read row by row, and
    # their stamps are those of arrival: alignments share errors of more than a pixel, which the
    # gyro's noise has no part in. With the clock 5 ms off the bias is 4e-3 rad/s off; without the
    # rolling shutter 1e-2. Begun elsewhere the same twelve seconds give errors up to twice the
    # bound, and the covariance says so: they stay within what it explains.
    recording = sf.io.open_recording(recordings / "tum-fr1-rpy-a")
    apart_ns = clock_offset_ns(recording)
    frames = [
        (frame.stamp_ns, np.asarray(frame.colour, np.float32).mean(axis=2), frame.depth_m)
        for frame in recording.frames()
        if frame.depth_m is not None and frame.colour is not None
    ]
    errors = []
    for start_s, seed in [(0.0, 0), (0.0, 1), (0.5, 1), (1.0, 0), (1.9, 0)]:
        rest = [f for f in frames if f[0] >= frames[0][0] + start_s * 1e9]
        error, share = bias_error(recording, rest, apart_ns, seed)
        print(
            f"tum-fr1-rpy-a from {start_s} s, noise {seed}: gyro bias off by {error:.1e} rad/s "
            f"after 10 s, squared {share:.2f} of its covariance per freedom"
        )
        errors.append(error)
        assert share < 3
    # Five starts together: a single one is chance, 0.9e-3 to 2.8e-3 for two forms of the filter.
    assert np.sqrt(np.mean(np.square(errors))) < 2e-3
    assert max(errors) < 4e-3
