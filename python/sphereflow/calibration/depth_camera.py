"""A depth camera calibrated from a recording of its motion: no target, no true poses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sphereflow
from sphereflow import io
from sphereflow.io import Recording
from sphereflow.odometry import SelfCalibration, SelfCalibrator

Progress = Callable[[str, int, int], None]
"""Called with what is being done, the steps done and the steps in all."""


@dataclass(frozen=True, slots=True)
class Calibrated:
    """What was found and the recording that it was found on, for ``found.write``."""

    found: SelfCalibration
    recording: Recording

    def write(self, path: str | Path) -> None:
        """Write the calibration file that ``sphereflow run --calibration`` takes."""
        self.found.write(path, self.recording)


def calibrate_depth(
    data: str | Path,
    *,
    calibration: str | Path | None = None,
    depth_scale: float | None = None,
    max_frames: int | None = None,
    readout: bool = True,
    max_pairs: int | None = None,
    progress: Progress | None = None,
) -> Calibrated:
    """Find what is left of the lens, the smooth error of 1/Z, and the read-out time.

    Parameters
    ----------
    data
        Folder of a recording: a camera turned and moved by hand in front of structure, at various
        distances, about ten seconds.
    calibration, depth_scale
        The calibration so far, where the recording's own is missing or wrong.
    max_frames
        Use the first so many frames.
    readout
        Also estimate the rolling shutter's read-out time.
    max_pairs
        Pairs of frames at most.
    progress
        Told how far it is.

    Returns
    -------
    Calibrated
        Also where nothing was observable: look at ``found.status``.

    Raises
    ------
    sphereflow.SphereflowError
        Where the recording cannot be read, has no calibration, sees all around, or its depth is
        corrected already.
    """
    recording = _opened(data, calibration, depth_scale, max_frames)
    calibrator = SelfCalibrator(
        recording.camera,  # type: ignore[arg-type]  # checked in _opened
        readout=readout,
        readout_s=recording.readout_s or 0.0,
        max_pairs=max_pairs,
    )
    return _calibrated(recording, calibrator, max_frames, progress)


def calibrate_rolling_shutter(
    data: str | Path,
    *,
    calibration: str | Path | None = None,
    depth_scale: float | None = None,
    max_frames: int | None = None,
    max_pairs: int | None = None,
    progress: Progress | None = None,
) -> Calibrated:
    """Find the read-out time alone; parameters as of ``calibrate_depth``."""
    recording = _opened(data, calibration, depth_scale, max_frames)
    calibrator = SelfCalibrator(
        recording.camera,  # type: ignore[arg-type]  # checked in _opened
        lens=False,
        field=False,
        readout_s=recording.readout_s or 0.0,
        max_pairs=max_pairs,
    )
    return _calibrated(recording, calibrator, max_frames, progress)


def _calibrated(
    recording: Recording,
    calibrator: SelfCalibrator,
    max_frames: int | None,
    progress: Progress | None,
) -> Calibrated:
    tell = progress or (lambda what, done, total: None)
    total = len(recording) if max_frames is None else min(max_frames, len(recording))
    frames = recording.frames(0, total)
    for index in range(total):
        try:
            frame: Any = next(frames)
        except sphereflow.SphereflowError:
            continue  # one frame that cannot be read: the others calibrate as well
        if frame.depth_m is not None:
            calibrator.push(frame.depth_m, frame.stamp_ns)
        tell("track", index + 1, total)
    found = calibrator.solve(lambda done, steps: tell("calibrate", done, steps))
    return Calibrated(found, recording)


def _opened(
    data: str | Path,
    calibration: str | Path | None,
    depth_scale: float | None,
    max_frames: int | None,
) -> Recording:
    if max_frames is not None and max_frames < 1:
        raise sphereflow.ValueRangeError(f"max_frames must be at least 1, found {max_frames}")
    recording = io.open_recording(data, calibration=calibration, depth_scale=depth_scale)
    if recording.camera is None:
        raise sphereflow.DataError(
            f"no calibration was found ({recording.calibration_source}): give a calibration file"
        )
    if recording.depth_corrected:
        raise sphereflow.DataError(
            f"the depth is corrected already ({recording.calibration_source}): calibrate with a "
            "calibration file without [depth_correction]"
        )
    return recording
