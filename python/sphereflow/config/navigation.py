"""Pose, velocity and biases from whatever comes."""

from __future__ import annotations

from dataclasses import dataclass

from sphereflow.config.base import Config
from sphereflow.config.imu_bias import ACCEL_SIGMA_M_S2, GYRO_SIGMA_RAD_S

_Row = tuple[float, float, float, float]

_IDENTITY: tuple[_Row, _Row, _Row, _Row] = (
    (1.0, 0.0, 0.0, 0.0),
    (0.0, 1.0, 0.0, 0.0),
    (0.0, 0.0, 1.0, 0.0),
    (0.0, 0.0, 0.0, 1.0),
)


@dataclass(frozen=True)
class NavigationConfig(Config):
    """Settings of ``NavigationFilter``.

    Parameters
    ----------
    gravity_m_s2
        Gravity itself in the world.
    body_from_camera
        Where the camera sits on the IMU: 4x4, row by row.
    gyro_sigma_rad_s, accel_sigma_m_s2
        Standard deviation of one reading.
    gyro_walk, accel_walk
        How the bias wanders, rad/s/sqrt(s) and m/s^2/sqrt(s).
    gyro_bias_sigma, accel_bias_sigma
        Standard deviation of the bias at the start, rad/s and m/s^2.
    mag_heading_sigma_rad
        Of the heading from one magnetometer reading.
    max_delay_s
        So late may a sample come, seconds.
    max_gap_s
        Longer steps between inertial readings are gaps, seconds.
    velocity_gate
        A velocity beyond this squared distance is left out.
    pose_gate
        A pose beyond this squared distance is left out.
    patience_s
        After so long of nothing but rejected poses the filter doubts itself, seconds.
    gyro_limit_rad_s
        Largest rate that the gyro can read, rad/s.
    """

    gravity_m_s2: tuple[float, float, float] = (0.0, 9.81, 0.0)
    body_from_camera: tuple[_Row, _Row, _Row, _Row] = _IDENTITY
    gyro_sigma_rad_s: float = GYRO_SIGMA_RAD_S
    accel_sigma_m_s2: float = ACCEL_SIGMA_M_S2
    gyro_walk: float = 2e-5
    accel_walk: float = 5e-4
    gyro_bias_sigma: float = 0.03
    accel_bias_sigma: float = 0.2
    mag_heading_sigma_rad: float = 0.2
    max_delay_s: float = 0.5
    max_gap_s: float = 0.1
    velocity_gate: float = 25.0
    pose_gate: float = 35.0
    patience_s: float = 1.0
    gyro_limit_rad_s: float = 34.9
