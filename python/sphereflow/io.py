"""Recordings, calibration and point clouds on disk."""

from sphereflow._native import Frame, Recording, RecordingWriter, open_recording

__all__ = ["Frame", "Recording", "RecordingWriter", "open_recording"]
