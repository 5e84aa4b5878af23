"""The IMU in bundle adjustment and alone, and keyframes that leave with their velocities."""

from __future__ import annotations

import numpy as np
import pytest
import sphereflow as sf
from sphereflow.solver import BundleProblem, ImuPreintegration, InertialWindow, Motion

GRAVITY = np.array([0.0, 9.81, 0.0])
EVERY_S, SAMPLE_S = 0.3, 0.002
GYRO_BIAS, ACCEL_BIAS = np.array([0.01, -0.02, 0.015]), np.array([0.05, 0.1, -0.08])
KEYFRAMES = 7


def position(t: float) -> np.ndarray:
    return np.array([np.sin(0.8 * t), 0.3 * np.cos(1.7 * t), 0.5 * t * t])


def velocity(t: float) -> np.ndarray:
    return np.array([0.8 * np.cos(0.8 * t), -0.51 * np.sin(1.7 * t), t])


def acceleration(t: float) -> np.ndarray:
    return np.array([-0.64 * np.sin(0.8 * t), -0.867 * np.cos(1.7 * t), 1.0])


def pose(t: float) -> np.ndarray:
    """World from body: a turn of 0.5 rad/s about the vertical."""
    c, s = np.cos(0.5 * t), np.sin(0.5 * t)
    made = np.eye(4)
    made[:3, :3] = [[c, 0, s], [0, 1, 0], [-s, 0, c]]
    made[:3, 3] = position(t)
    return made


def samples(start: float) -> ImuPreintegration:
    """What an IMU with biases measures from ``start`` on, without noise, around no biases."""
    times = start + SAMPLE_S * (np.arange(round(EVERY_S / SAMPLE_S)) + 0.5)
    gyro = np.array([0.0, 0.5, 0.0]) + GYRO_BIAS + np.zeros((len(times), 3))
    force = [pose(t)[:3, :3].T @ (acceleration(t) - GRAVITY) + ACCEL_BIAS for t in times]
    made = ImuPreintegration(gyro_sigma=1e-3, accel_sigma=1e-2, gyro_walk=1e-5, accel_walk=1e-4)
    made.push(gyro, np.array(force), SAMPLE_S)
    return made


def window(*, imu: bool) -> BundleProblem:
    """A camera that moves with an IMU; scale is a fifth off and comes from the IMU alone."""
    rng = np.random.default_rng(4)
    camera = sf.Camera.equirectangular(1024, 512)
    problem = BundleProblem()
    problem.add_camera(camera)
    problem.set_imu(GRAVITY, np.eye(4))
    truth = [pose(EVERY_S * k) for k in range(KEYFRAMES)]
    for k, known in enumerate(truth):
        start = known.copy()
        start[:3, 3] += 0.2 * (known[:3, 3] - truth[0][:3, 3])
        problem.add_pose(start, fixed=k == 0)
        if imu:
            problem.add_motion(k)
    directions = rng.normal(size=(120, 3))
    points = directions / np.linalg.norm(directions, axis=1)[:, None] * rng.uniform(2, 6, (120, 1))
    problem.add_points(points + 0.2 * (points - truth[0][:3, 3]))
    for k, known in enumerate(truth):
        pixel = camera.project((points - known[:3, 3]) @ known[:3, :3])
        # the image ends where it begins: a pixel there could come back on the other side
        index = np.flatnonzero(np.abs(pixel[:, 0] - 512) < 480)
        noisy = pixel[index] + rng.normal(0, 0.3, (len(index), 2))
        problem.add_pixels(np.full(len(index), k), index, noisy, sigma_px=0.3)
    if imu:
        for k in range(1, KEYFRAMES):
            problem.add_imu(k - 1, k, samples(EVERY_S * (k - 1)))
        problem.add_bias_prior(0, Motion(), gyro_sigma=0.1, accel_sigma=1.0)
    return problem


def worst_centre(problem: BundleProblem) -> float:
    truth = np.array([position(EVERY_S * k) for k in range(KEYFRAMES)])
    return float(np.linalg.norm(problem.poses[:, :3, 3] - truth, axis=1).max())


def test_imu_samples_give_pixels_their_scale() -> None:
    without, with_imu = window(imu=False), window(imu=True)
    assert any("1 direction" in issue for issue in without.solve(max_iterations=50).issues)
    result = with_imu.solve(max_iterations=50, function_tolerance=1e-12)
    assert result.converged
    assert result.issues == []
    print(
        f"worst centre {worst_centre(with_imu):.4f} m, without samples {worst_centre(without):.4f}"
    )
    assert worst_centre(with_imu) < 0.02 < 0.15 < worst_centre(without)
    motion = with_imu.motion(3)
    assert motion is not None
    assert np.allclose(motion.velocity_m_s, velocity(3 * EVERY_S), atol=0.02)
    assert np.allclose(motion.gyro_bias_rad_s, GYRO_BIAS, atol=2e-3)
    assert np.allclose(motion.accel_bias_m_s2, ACCEL_BIAS, atol=5e-2)
    assert without.motion(3) is None


def test_marginalised_keyframes_leave_poses_motions_and_covariance() -> None:
    problem = window(imu=True)
    problem.solve(max_iterations=50, function_tolerance=1e-14)
    poses, covariance, motion = problem.poses, problem.covariance([6]), problem.motion(6)
    before = problem.measurements
    problem.marginalise([0, 1])
    assert problem.measurements < before
    assert problem.solve(max_iterations=50, function_tolerance=1e-14).converged
    after = problem.motion(6)
    assert motion is not None
    assert after is not None
    # the prior is the second order of what left, at the minimum
    assert np.allclose(problem.poses, poses, atol=1e-6)
    assert np.allclose(after.velocity_m_s, motion.velocity_m_s, atol=1e-6)
    assert np.allclose(problem.covariance([6]), covariance, rtol=1e-4, atol=1e-10)


def test_preintegration_changes_as_the_motion_does() -> None:
    made = samples(0.0)
    rotation, speed, way = made.change(
        Motion(gyro_bias_rad_s=GYRO_BIAS, accel_bias_m_s2=ACCEL_BIAS)
    )
    first, last, dt = pose(0.0), pose(EVERY_S), made.seconds
    back = first[:3, :3].T
    assert dt == pytest.approx(EVERY_S)
    # biases move it to first order: 0.02 rad/s for 0.3 s leaves squares of 0.006
    assert np.allclose(rotation, back @ last[:3, :3], atol=1e-4)
    assert np.allclose(speed, back @ (velocity(dt) - velocity(0) - GRAVITY * dt), atol=1e-3)
    fallen = position(dt) - position(0) - velocity(0) * dt - GRAVITY * dt * dt / 2
    assert np.allclose(way, back @ fallen, atol=1e-3)


def test_window_of_measured_poses_finds_biases_and_velocities() -> None:
    states = InertialWindow(pose(0.0), GRAVITY)
    states.add_pose(0, pose(0.0), np.eye(6) * 1e-8)
    states.add_bias_prior(0, Motion(), gyro_sigma=0.1, accel_sigma=1.0)
    for k in range(KEYFRAMES):
        index = states.push(samples(EVERY_S * k))
        states.add_pose(index, pose(EVERY_S * (k + 1)), np.eye(6) * 1e-8)
    result = states.solve(function_tolerance=1e-12)
    assert result.converged
    found = states.motions[3]
    assert np.allclose(found.gyro_bias_rad_s, GYRO_BIAS, atol=1e-3)
    assert np.allclose(found.accel_bias_m_s2, ACCEL_BIAS, atol=2e-2)
    assert np.allclose(found.velocity_m_s, velocity(3 * EVERY_S), atol=1e-2)
    assert states.poses.shape == (KEYFRAMES + 1, 4, 4)


def test_bad_inertial_arguments_are_errors_by_name() -> None:
    problem, made = window(imu=True), samples(0.0)
    with pytest.raises(sf.ValueRangeError, match="gravity"):
        problem.set_imu([np.nan, 0, 0], np.eye(4))
    with pytest.raises(sf.ValueRangeError, match="pose"):
        problem.add_motion(0)
    with pytest.raises(sf.ValueRangeError, match="to"):
        problem.add_imu(0, 99, made)
    with pytest.raises(sf.ValueRangeError, match="poses"):
        problem.marginalise([99])
    with pytest.raises(sf.ShapeError, match="velocity_m_s"):
        Motion(velocity_m_s=[1, 2])
    with pytest.raises(sf.ValueRangeError, match="velocity"):
        window(imu=False).add_motion(0, Motion(velocity_m_s=[np.nan, 0, 0]))
    with pytest.raises(sf.ShapeError, match="gyro_rad_s, accel_m_s2"):
        made.push(np.zeros((2, 3)), np.zeros((3, 3)), 0.01)
    with pytest.raises(sf.ValueRangeError, match="dt_s"):
        made.push(np.zeros((2, 3)), np.zeros((2, 3)), -0.01)
    with pytest.raises(sf.ValueRangeError, match="gyro"):
        made.push([[np.nan, 0, 0]], np.zeros((1, 3)), 0.01)
    assert made.seconds == pytest.approx(EVERY_S)  # all of a call, or none
    with pytest.raises(sf.ValueRangeError, match=r"sigmas\.gyro"):
        ImuPreintegration(gyro_sigma=0, accel_sigma=1, gyro_walk=1, accel_walk=1)
    with pytest.raises(sf.ValueRangeError, match="state"):
        InertialWindow(pose(0.0), GRAVITY).add_pose(5, pose(0.0), np.eye(6))
