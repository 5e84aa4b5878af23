"""Biases of velocities and of inertial sensors, from images, from velocities, and from rest."""

from sphereflow._native import (
    ImuBiasEstimator,
    ImuBiasRun,
    ImuBiasState,
    VelocityBiasEstimator,
    VelocityBiasState,
    calibrate_camera_imu,
    calibrate_imu_still,
    calibrate_mag_ellipsoid,
)

__all__ = [
    "ImuBiasEstimator",
    "ImuBiasRun",
    "ImuBiasState",
    "VelocityBiasEstimator",
    "VelocityBiasState",
    "calibrate_camera_imu",
    "calibrate_imu_still",
    "calibrate_mag_ellipsoid",
]
