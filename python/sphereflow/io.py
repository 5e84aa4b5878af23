"""Recordings, calibration and point clouds on disk."""

from sphereflow._native import Frame, Recording, open_recording

__all__ = ["Frame", "Recording", "open_recording"]
