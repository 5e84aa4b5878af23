"""Velocity and trajectory from depth images: the geometric flow of Chapter 6."""

from sphereflow._native import (
    DepthOdometry,
    Information,
    OdometryResult,
    RangeFlow,
    SelfCalibration,
    SelfCalibrator,
    VelocityEstimate,
    estimate_velocity,
    information,
)

__all__ = [
    "DepthOdometry",
    "Information",
    "OdometryResult",
    "RangeFlow",
    "SelfCalibration",
    "SelfCalibrator",
    "VelocityEstimate",
    "estimate_velocity",
    "information",
]
