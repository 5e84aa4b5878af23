"""Velocity and trajectory from depth images: the geometric flow of Chapter 6."""

from sphereflow._native import (
    DepthOdometry,
    OdometryResult,
    SelfCalibration,
    SelfCalibrator,
    VelocityEstimate,
    estimate_velocity,
)

__all__ = [
    "DepthOdometry",
    "OdometryResult",
    "SelfCalibration",
    "SelfCalibrator",
    "VelocityEstimate",
    "estimate_velocity",
]
