"""Attitude from gyro, accelerometer and magnetometer, or from gyro and vision."""

from sphereflow._native import AttitudeFilter, AttitudeRun, AttitudeState, VisualAttitude

__all__ = ["AttitudeFilter", "AttitudeRun", "AttitudeState", "VisualAttitude"]
