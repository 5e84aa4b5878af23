"""Velocity and trajectory from depth images: the geometric flow of Chapter 6."""

from sphereflow._native import (
    DepthOdometry,
    OdometryResult,
    RangeFlow,
    VelocityEstimate,
    estimate_velocity,
)

__all__ = [
    "DepthOdometry",
    "OdometryResult",
    "RangeFlow",
    "VelocityEstimate",
    "estimate_velocity",
]
