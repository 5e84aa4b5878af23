"""Pose, velocity and biases from whatever comes: an answer that is always there."""

from sphereflow._native import NavigationFilter, NavigationState, PositionObserver

__all__ = ["NavigationFilter", "NavigationState", "PositionObserver"]
