"""Bad readings: single ones of any size, gaps, covariances that are none; from Python."""

import numpy as np
import pytest
from sphereflow.attitude import AttitudeFilter, VisualAttitude
from sphereflow.navigation import NavigationFilter, PositionObserver
from sphereflow.observers import ImuBiasEstimator

UP = np.array([0.0, 0.0, 9.81])
FIELD = np.array([0.0, 21.0, -40.0])
STEP_S = 0.004

# One sample of 4 ms below what is held back: (1 + 200 * 0.004) rad/s * 4 ms = 0.4 degrees.
SPIKE_DEG = 0.5


def angle_deg(q: np.ndarray, p: np.ndarray) -> float:
    """Angle between two attitudes."""
    return float(np.degrees(2 * np.arccos(min(1.0, abs(np.dot(q, p))))))


@pytest.mark.parametrize("method", ["inertial", "invariant"])
@pytest.mark.parametrize(
    ("sensor", "size"),
    [(0, 30.0), (0, 180.0), (0, 4e155), (1, 90.0), (1, 777.0), (1, 5e4), (1, 3e6), (2, 1e250)],
)
def test_attitude_after_one_bad_sample_stays_where_it_is(
    method: str, sensor: int, size: float
) -> None:
    attitude = AttitudeFilter(method)
    before = None
    for i in range(3000):
        readings = [np.zeros(3), UP.copy(), FIELD.copy()]
        if i == 2000:
            before = attitude.state.quat_xyzw
            readings[sensor][0] = size
        state = attitude.step(*readings, dt_s=STEP_S)
        if i == 2000:
            assert state.status != "ok"
            assert state.reason
        if before is not None:
            assert angle_deg(state.quat_xyzw, before) < SPIKE_DEG
    assert state.status == "ok"
    assert attitude.refused == 1


def test_visual_attitude_after_one_bad_rate_stays_where_it_is() -> None:
    visual = VisualAttitude(1.0)
    seen = np.array([0.0, 0.0, 0.0, 1.0])
    for i in range(1000):
        rate = [9e156, 0.0, 0.0] if i == 500 else [0.0, 0.0, 0.0]
        status, reason = visual.step(rate, seen, dt_s=STEP_S)
        if i == 500:
            assert status == "skipped"
            assert "beyond" in reason
    assert angle_deg(visual.quat_xyzw, seen) < 1e-6
    assert visual.refused == 1


def sound(covariance: np.ndarray) -> bool:
    """Finite, and positive definite once units do not matter."""
    if not np.isfinite(covariance).all() or (np.diag(covariance) <= 0).any():
        return False
    sigma = np.sqrt(np.diag(covariance))
    return bool(np.linalg.eigvalsh(covariance / np.outer(sigma, sigma)).min() > 0)


@pytest.mark.parametrize("method", ["ekf", "observer"])
@pytest.mark.parametrize(("sensor", "size"), [(0, 130.0), (0, 2e158), (1, 2500.0), (1, 7e290)])
def test_imu_biases_after_one_bad_sample_stay_where_they_are(
    method: str, sensor: int, size: float
) -> None:
    estimator, twin = ImuBiasEstimator(method), ImuBiasEstimator(method)
    for i in range(4000):
        readings = [np.array([0.01, 0.0, 0.0]), np.array([0.0, -9.81, 0.0])]
        velocity = [0.0, 0.0, 0.0] if i % 8 == 0 else None
        clean = twin.step(*readings, velocity, velocity, dt_s=STEP_S)
        if i == 2500:
            readings[sensor][2] = size
        state = estimator.step(*readings, velocity, velocity, dt_s=STEP_S)
        assert np.linalg.norm(state.accel_bias - clean.accel_bias) < 0.01
        assert np.linalg.norm(state.gyro_bias - clean.gyro_bias) < 1e-3
    assert state.covariance is None or sound(state.covariance)
    assert estimator.refused == 1


@pytest.mark.parametrize("gap_s", [0.3, 8.0, 5000.0, 100_000.0])
def test_navigation_covariance_through_a_gap_is_positive_definite(gap_s: float) -> None:
    navigation = NavigationFilter()
    pose = np.eye(4)
    for i in range(1500):
        stamp_ns = int(i * STEP_S * 1e9) + (0 if i < 700 else int(gap_s * 1e9))
        accel = [0.0, -9.81, 0.0]
        if i == 300:
            accel = [6e299, 0.0, 0.0]
        navigation.push_imu(stamp_ns, [0.0, 0.0, 0.0], accel)
        state = navigation.state(stamp_ns)
        assert sound(state.covariance), i
        if i == 700:
            # A walk's way, at least, can have been gone.
            lost = np.sqrt(np.trace(state.covariance[6:9, 6:9]))
            assert lost > 0.1 * gap_s
        if i % 8 == 0 and i != 704:
            navigation.push_pose(stamp_ns, pose, (0.005, 0.01))
    assert state.status == "ok"
    assert np.linalg.norm(state.position_m) < 0.05
    assert navigation.refused == 1


def test_navigation_covariance_that_is_none_is_refused_by_name() -> None:
    navigation = NavigationFilter()
    navigation.push_imu(0, [0.0, 0.0, 0.0], [0.0, -9.81, 0.0])
    skew = np.array([[1.0, 3.0, 0.0], [3.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    status, reason = navigation.push_velocity(1000, [0.0, 0.0, 0.0], skew)
    assert status == "skipped"
    assert "covariance" in reason
    assert navigation.refused == 1


def test_position_observer_after_one_bad_sample_stays_where_it_is() -> None:
    observer = PositionObserver([0.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    attitude = [0.0, 0.0, 0.0, 1.0]
    for i in range(1000):
        accel = [0.0, -9.81, 4e5] if i == 500 else [0.0, -9.81, 0.0]
        position = [0.0, 1e12, 0.0] if i == 700 else [0.0, 0.0, 0.0]
        observer.step([0.0] * 3, accel, attitude, [0.0] * 3, position, dt_s=STEP_S)
        assert np.linalg.norm(observer.position_m) < 1e-9
    assert observer.refused == 2
