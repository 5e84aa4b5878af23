"""Simulated rooms, cameras and inertial sensors with honest noise; the same seed, the same world."""

from sphereflow._native import Simulator

__all__ = ["Simulator"]
