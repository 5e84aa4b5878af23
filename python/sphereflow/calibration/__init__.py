"""Calibration of a depth camera, and of inertial and magnetic sensors.

From a recording: `calibrate_depth` and `calibrate_rolling_shutter`, without a target; `imu_still`,
`mag_ellipsoid` and `camera_imu`. From arrays or frames of one's own: `SelfCalibrator` and the
functions `calibrate_...`.
"""

from sphereflow._native import (
    SelfCalibration,
    SelfCalibrator,
    calibrate_camera_imu,
    calibrate_imu_still,
    calibrate_mag_ellipsoid,
)
from sphereflow.calibration.depth_camera import (
    Calibrated,
    calibrate_depth,
    calibrate_rolling_shutter,
)
from sphereflow.calibration.sensors import camera_imu, imu_still, mag_ellipsoid

__all__ = [
    "Calibrated",
    "SelfCalibration",
    "SelfCalibrator",
    "calibrate_camera_imu",
    "calibrate_depth",
    "calibrate_imu_still",
    "calibrate_mag_ellipsoid",
    "calibrate_rolling_shutter",
    "camera_imu",
    "imu_still",
    "mag_ellipsoid",
]
