"""The Python face of the bias estimators, the navigation filter and the calibrations."""

import json
from pathlib import Path

import numpy as np
import pytest
import sphereflow as sf
from sphereflow.cli.app import app
from sphereflow.navigation import NavigationFilter, PositionObserver
from sphereflow.observers import (
    ImuBiasEstimator,
    VelocityBiasEstimator,
    calibrate_camera_imu,
    calibrate_mag_ellipsoid,
)
from typer.testing import CliRunner


def test_velocity_bias_of_a_simulated_room_is_found_without_linear_velocity() -> None:
    # A room without furniture: edges of depth pull the estimate by 4e-3 rad/s in a furnished one.
    room = sf.sim.Simulator(
        scene="thesis_room",
        motion="sinusoids_411",
        duration_s=1.0,
        depth_noise="none",
        image_sigma_grey=0.0,
    )
    truth, bias = room.truth, np.array([0.02, -0.01, 0.03])
    estimator = VelocityBiasEstimator(room.camera)
    for i, frame in enumerate(room.frames(0, 20)):
        rate = np.zeros(3)
        if i > 0:
            rate = body_rate(truth.quat_xyzw[i - 1], truth.quat_xyzw[i]) * 30
        grey = np.asarray(frame.colour, np.float32).mean(axis=2)
        state = estimator.step(grey, frame.depth_m, rate + bias, dt_s=1 / 30)
    assert np.linalg.norm(state.angular_rad_s - bias) < 2e-3
    assert state.linear_m_s is None
    with pytest.raises(sf.ShapeError, match="grey"):
        estimator.step(grey[1:], frame.depth_m, bias, dt_s=1 / 30)


def body_rate(before: np.ndarray, now: np.ndarray) -> np.ndarray:
    """Rotation vector of the turn between two attitudes, body frame."""
    x, y, z, w = before
    left = np.array([[w, z, -y, -x], [-z, w, x, -y], [y, -x, w, -z], [x, y, z, w]])
    turn = left @ now
    return 2 * turn[:3] * np.sign(turn[3])


def test_imu_bias_estimator_at_rest_knows_the_gyro_and_names_what_it_cannot_know() -> None:
    estimator = ImuBiasEstimator()
    for i in range(2000):
        velocity = [0, 0, 0] if i % 7 == 0 else None
        state = estimator.step(
            [0.01, 0, 0], [0, -9.81, 0], velocity, velocity, velocity_sigma=0.01, dt_s=0.005
        )
    assert abs(state.gyro_bias[0] - 0.01) < 1e-3
    assert state.status == "weak"
    assert "not observable" in state.reason
    assert estimator.blind_directions.shape == (3, 3)


def test_navigation_filter_answers_without_vision_with_growing_covariance() -> None:
    navigation = NavigationFilter()
    assert navigation.state(0) is None
    for i in range(400):
        navigation.push_imu(i * 5_000_000, [0, 0, 0], [0, -9.81, 0])
        if i == 10:
            status, reason = navigation.push_pose(i * 5_000_000, np.eye(4), (0.01, 0.01))
            assert (status, reason) == ("starting", "nothing was measured yet")
    state = navigation.state(399 * 5_000_000)
    assert state.status == "weak"
    assert "integrating" in state.reason
    assert np.trace(state.covariance[6:9, 6:9]) > 1e-3
    assert abs(np.linalg.norm(state.quat_xyzw) - 1) < 1e-12
    late = navigation.push_velocity(0, [0, 0, 0], 0.01)
    assert late[0] == "skipped"
    assert "late" in late[1]


def test_position_observer_reaches_millimetres_with_gravity_added_and_names_bad_samples() -> None:
    # Thesis: eq. (9.5), corrected: 1.3 mm and 4 mm/s with inputs of 5 mm and 0.01 m/s.
    rng = np.random.default_rng(1)
    observer = PositionObserver([0.0, 0, 0], [0.0, 0, 0])
    errors = []
    for i in range(1, 8000):
        t = i * 0.005
        # A body that swings along x and turns about its vertical.
        angle, rate = 0.5 * np.sin(0.8 * t), 0.4 * np.cos(0.8 * t)
        c, s = np.cos(angle), np.sin(angle)
        to_body = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])  # y down: about +y
        place = np.array([0.3 * np.sin(1.5 * t), 0, 0])
        speed = to_body @ np.array([0.45 * np.cos(1.5 * t), 0, 0])
        force = to_body @ np.array([-0.675 * np.sin(1.5 * t), -9.81, 0])
        status, _ = observer.step(
            np.array([0, rate, 0]) + rng.normal(scale=2.5e-3, size=3),
            force + rng.normal(scale=0.028, size=3),
            [0, np.sin(angle / 2), 0, np.cos(angle / 2)],
            speed + rng.normal(scale=0.01, size=3),
            place + rng.normal(scale=0.005, size=3),
            dt_s=0.005,
        )
        errors.append(
            (
                np.linalg.norm(observer.position_m - place),
                np.linalg.norm(observer.velocity_m_s - speed),
            )
        )
    place_m, speed_m_s = np.sqrt(np.mean(np.square(errors[4000:]), axis=0))
    assert status == "ok"
    assert place_m < 1.3e-3 * 1.1  # norms of three axes
    assert speed_m_s < 4e-3 * 1.1
    rest = ([0.0, 0, 0], [0, -9.81, 0], [0, 0, 0, 1])
    status, reason = observer.step([np.nan, 0, 0], *rest[1:], dt_s=0.005)
    assert (status, reason) == ("skipped", "gyro: a number is not finite")
    assert observer.step(*rest, dt_s=0.0)[1] == "the stamp does not increase"
    assert observer.step(*rest, dt_s=1.0)[1] == "1.000 s without samples"
    with pytest.raises(sf.ValueRangeError, match="k_vx"):
        PositionObserver([0, 0, 0], [0, 0, 0], k_vx=-1)
    with pytest.raises(sf.ValueRangeError, match="position_m"):
        PositionObserver([0, 0, 0], [0, np.nan, 0])


def test_imu_bias_run_skips_stamps_that_do_not_increase() -> None:
    recording = swaying(5.0)
    stamps = recording["stamp_ns"].copy()
    stamps[500] = stamps[499]
    stamps[600] = stamps[400]
    run = ImuBiasEstimator().run(**{**recording, "stamp_ns": stamps})
    assert [run.status[i] for i in (500, 501, 600, 601)].count("skipped") == 2
    assert run.reason[600] == "the stamp does not increase"
    clean = ImuBiasEstimator().run(**recording)
    assert np.linalg.norm(run.velocity_m_s[-1] - clean.velocity_m_s[-1]) < 0.01


def test_calibrations_say_what_they_found_and_whether_it_was_shown() -> None:
    rng = np.random.default_rng(0)
    field = rng.normal(size=(500, 3))
    field *= 48 / np.linalg.norm(field, axis=1, keepdims=True)
    found = calibrate_mag_ellipsoid(field + np.array([5, -3, 8]))
    np.testing.assert_allclose(found["hard_iron_ut"], [5, -3, 8], atol=1e-6)
    assert found["status"] == "ok"
    t = np.arange(0, 10, 0.005)
    gyro = np.stack([np.sin(2 * t), np.cos(3 * t), 0.5 * np.sin(t + 1)], 1)
    stamps = np.round(t * 1e9).astype(np.int64)
    found = calibrate_camera_imu(gyro[20:-20:6], stamps[20:-20:6] + 12_000_000, gyro, stamps)
    assert abs(found["time_offset_s"] + 0.012) < 1e-4
    assert found["status"] == "ok"


def test_cli_calibrations_of_a_simulated_recording(tmp_path: Path) -> None:
    runner = CliRunner()
    still = sf.sim.Simulator(motion="still", duration_s=12.0, rate_hz=1.0)
    still.write(tmp_path / "still")
    result = runner.invoke(app, ["calib", "imu-still", str(tmp_path / "still"), "--json"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert found["status"] == "ok"
    assert len(found["gyro_bias_rad_s"]) == 3
    result = runner.invoke(app, ["calib", "mag-ellipsoid", str(tmp_path / "still")])
    assert result.exit_code != 0
    assert "magnetometer" in result.output
    moving = sf.sim.Simulator(motion="hand_held", duration_s=2.0, depth_noise="none")
    moving.write(tmp_path / "moving")
    result = runner.invoke(app, ["calib", "camera-imu", str(tmp_path / "moving"), "--json"])
    found = json.loads(result.stdout)
    assert abs(found["quat_xyzw"][3]) > 0.999
    assert abs(found["time_offset_s"]) < 0.005


def test_cli_calibrations_name_what_a_recording_does_not_excite(tmp_path: Path) -> None:
    runner = CliRunner()
    moving = sf.sim.Simulator(motion="hand_held", duration_s=12.0, rate_hz=1.0, depth_noise="none")
    moving.write(tmp_path / "moving")
    result = runner.invoke(app, ["calib", "imu-still", str(tmp_path / "moving")])
    assert result.exit_code != 0
    assert "the recording is not at rest" in result.output
    result = runner.invoke(app, ["calib", "camera-imu", str(tmp_path / "moving")])
    assert result.exit_code != 0
    assert "expected at least 20 pairs of frames" in result.output
    still = sf.sim.Simulator(motion="still", duration_s=2.0)
    still.write(tmp_path / "still")
    result = runner.invoke(app, ["calib", "camera-imu", str(tmp_path / "still")])
    assert result.exit_code != 0
    assert "weak" in result.output
    # A magnetometer turned about one axis only.
    angle = np.linspace(0, 6, 200)
    turned = np.stack([40 * np.cos(angle), 40 * np.sin(angle), 5 * np.sin(9 * angle)], 1)
    with pytest.raises(sf.ValueRangeError, match="turned all ways"):
        calibrate_mag_ellipsoid(turned)


def swaying(seconds: float) -> dict[str, np.ndarray]:
    """Readings of a sensor that sways at one place: gyro, specific force, velocities (y down)."""
    stamp_ns = np.arange(int(seconds * 200)) * 5_000_000
    t = stamp_ns * 1e-9
    rng = np.random.default_rng(3)
    roll = 0.8 * np.sin(0.9 * t)  # about z, then about x in the body
    pitch = 0.6 * np.sin(0.7 * t + 1)
    roll_rate, pitch_rate = 0.72 * np.cos(0.9 * t), 0.42 * np.cos(0.7 * t + 1)
    # world_from_body = Rz(roll) Rx(pitch)
    gyro = np.stack([pitch_rate, roll_rate * np.sin(pitch), roll_rate * np.cos(pitch)], 1)
    up_after_roll = -9.81 * np.stack([np.sin(roll), np.cos(roll), 0 * t], 1)
    x, y = up_after_roll[:, 0], up_after_roll[:, 1]
    accel = np.stack([x, y * np.cos(pitch), -y * np.sin(pitch)], 1)
    velocity = np.full((len(t), 3), np.nan)
    velocity[::7] = rng.normal(scale=0.005, size=(len(t[::7]), 3))
    return {
        "stamp_ns": stamp_ns,
        "gyro_rad_s": gyro
        + np.array([0.01, -0.008, 0.012])
        + rng.normal(scale=2e-3, size=gyro.shape),
        "accel_m_s2": accel
        + np.array([0.07, -0.02, -0.1])
        + rng.normal(scale=0.03, size=gyro.shape),
        "velocity_m_s": velocity,
        "angular_rad_s": gyro + rng.normal(scale=2e-3, size=gyro.shape),
    }


def test_imu_bias_of_a_recording_forward_smoothed_and_in_loops() -> None:
    recording = swaying(30.0)
    true_accel = np.array([0.07, -0.02, -0.1])
    forward = ImuBiasEstimator().run(**recording, velocity_sigma=0.005)
    smooth = ImuBiasEstimator().run(**recording, velocity_sigma=0.005, smooth=True)
    assert len(forward) == len(recording["stamp_ns"])
    assert len(smooth) == len(recording["stamp_ns"][::7])
    np.testing.assert_array_equal(smooth.sample[:3], [0, 7, 14])
    assert np.linalg.norm(forward.accel_bias[-1] - true_accel) < 0.02
    # The smoother knows at the start what the filter knows at the end.
    assert np.linalg.norm(smooth.accel_bias[2] - true_accel) < 0.02
    assert np.linalg.norm(forward.accel_bias[14] - true_accel) > 0.05
    observer = ImuBiasEstimator("observer")
    once = observer.run(**recording).accel_bias[-1] - true_accel
    often = ImuBiasEstimator("observer").run(**recording, loops=15).accel_bias[-1] - true_accel
    assert np.linalg.norm(often) < np.linalg.norm(once)
    assert smooth.status[-1] == "ok"
    with pytest.raises(sf.ShapeError, match="accel_m_s2"):
        ImuBiasEstimator().run(**{**recording, "accel_m_s2": [[0, 0, 0]]})
    with pytest.raises(sf.ValueRangeError, match="loops"):
        ImuBiasEstimator().run(**recording, loops=0)
