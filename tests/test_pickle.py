"""Pickle and copy: an object of every class comes back with the same bits."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sphereflow as sf
from hypothesis import given, settings
from hypothesis import strategies as st

CAMERAS = [
    sf.Camera.pinhole(525.1, 524.3, 319.5, 239.7, 640, 480, skew=0.3),
    sf.Camera.opencv(525, 525, 319.5, 239.5, 640, 480, k1=0.1, p2=-1e-3, k6=0.01),
    sf.Camera.inverse_polynomial(525, 525, 319.5, 239.5, 640, 480, k1=0.1, dx=0.01),
    sf.Camera.fov(300, 301, 319.5, 239.5, 0.9, 640, 480, dy=0.02),
    sf.Camera.kannala_brandt(300, 301, 319.5, 239.5, 0.1, 0.01, -0.01, 0.001, 640, 480),
    sf.Camera.unified(300, 301, 319.5, 239.5, 0.6, 640, 480),
    sf.Camera.double_sphere(300, 301, 319.5, 239.5, -0.2, 0.6, 640, 480),
    sf.Camera.equirectangular(640, 320),
]
SMALL = sf.Camera.pinhole(60.0, 60.0, 39.5, 29.5, 80, 60)
COPIES: list[Callable[[Any], Any]] = [
    lambda value: pickle.loads(pickle.dumps(value)),
    copy.copy,
    copy.deepcopy,
]


def room(shift_m: float) -> np.ndarray:
    """Depth of a bent wall, metres."""
    v, u = np.mgrid[:60, :80].astype(np.float32)
    return (2.0 + shift_m + 0.3 * np.sin(u / 9) * np.cos(v / 7)).astype(np.float32)


def results() -> dict[str, Any]:
    """A result of each class that is quickly made."""
    odometry = sf.odometry.DepthOdometry(SMALL)
    frames = [odometry.push(room(shift), i * 10**8) for i, shift in enumerate((0.0, 0.01))]
    attitude = sf.attitude.AttitudeFilter()
    imu_bias = sf.observers.ImuBiasEstimator()
    navigation = sf.navigation.NavigationFilter()
    navigation.push_imu(0, [0, 0, 0.1], [0, -9.81, 0])
    grey = np.full((60, 80), 100.0, np.float32) + room(0.0) * 20
    filtered = sf.depth.DepthFilter(SMALL)
    gyro, accel = [[0.1, 0, 0]] * 3, [[0, 0, 9.81]] * 3
    stamps = [0, 10**7, 2 * 10**7]
    motion = {"v_m_s": [0.1, 0, 0], "omega_rad_s": [0, 0, 0], "dt_s": 0.1}
    velocity_bias = sf.observers.VelocityBiasEstimator(SMALL)
    graph = sf.solver.PoseGraph.generate("sphere", 3, 6)
    return {
        "OdometryResult started": frames[0],
        "OdometryResult": frames[1],
        "OdometryResult lost": odometry.push(None, 3 * 10**8),
        "VelocityEstimate": sf.odometry.estimate_velocity(SMALL, room(0.0), room(0.01), 0.1),
        "Information": sf.odometry.information(SMALL, room(0.0)),
        "SelfCalibration": sf.calibration.SelfCalibrator(SMALL).solve(),
        "AttitudeState": attitude.step([0.1, 0, 0], [0, 0, 9.81], dt_s=0.01),
        "AttitudeRun": attitude.run(gyro, accel, None, stamps),
        "ImuBiasState": imu_bias.step([0.1, 0, 0], [0, 0, 9.81], [0.1, 0, 0], dt_s=0.01),
        "ImuBiasRun": imu_bias.run(stamps, gyro, accel, [[0.1, 0, 0]] * 3),
        "VelocityBiasState": velocity_bias.step(grey, room(0.0), [0, 0, 0.1], dt_s=0.1),
        "NavigationState": navigation.state(0),
        "DepthResult": filtered.step(grey, world_from_camera=np.eye(4), stamp_ns=0),
        "VariationalDepth": sf.depth.sobolev_depth(SMALL, grey, grey[::-1], **motion),
        "SolverResult": graph.solve(),
        "Motion": sf.solver.Motion(velocity_m_s=[1, 2, 3], gyro_bias_rad_s=[0.1, 0, 0]),
    }


RESULTS = results()


def shown(value: Any) -> dict[str, Any]:
    """Everything public that an object says without being asked."""
    names = [name for name in dir(value) if not name.startswith("_")]
    return {name: v for name in names if not callable(v := getattr(value, name))}


@pytest.mark.parametrize("again", COPIES, ids=["pickle", "copy", "deepcopy"])
@pytest.mark.parametrize("name", RESULTS)
def test_pickle_of_a_result_says_the_same(name: str, again: Callable[[Any], Any]) -> None:
    before = RESULTS[name]
    after = again(before)
    assert type(after) is type(before)
    np.testing.assert_equal(_plain(shown(after)), _plain(shown(before)))


def _plain(shown_: dict[str, Any]) -> dict[str, Any]:
    """Objects of one's own in what is shown, such as cameras, as text."""
    own = (sf.Camera,)
    return {name: repr(v) if isinstance(v, own) else v for name, v in shown_.items()}


@pytest.mark.parametrize("again", COPIES, ids=["pickle", "copy", "deepcopy"])
@pytest.mark.parametrize("camera", CAMERAS, ids=lambda camera: camera.model)
def test_pickle_of_a_camera_is_equal(camera: sf.Camera, again: Callable[[Any], Any]) -> None:
    assert again(camera) == camera


@settings(deadline=None)
@given(
    st.lists(st.integers(-(2**62), 2**62), max_size=20, unique=True),
    st.integers(0, 2**32 - 1),
)
def test_pickle_of_a_trajectory_has_the_same_bits(stamps: list[int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    quat = rng.normal(size=(len(stamps), 4))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    position = rng.normal(size=(len(stamps), 3))
    trajectory = sf.Trajectory(np.array(sorted(stamps), np.int64), position, quat)
    for again in COPIES:
        after = again(trajectory)
        assert after == trajectory
        np.testing.assert_array_equal(after.quat_xyzw, trajectory.quat_xyzw)
        np.testing.assert_array_equal(after.position_m, trajectory.position_m)
