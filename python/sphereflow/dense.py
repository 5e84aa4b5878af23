"""Dense depth of a recording whose poses are known, into a folder with an error table."""

from __future__ import annotations

import csv
import json
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sphereflow._native import (
    DepthFilter,
    DepthResult,
    Frame,
    RecordingWriter,
    SphereGrid,
    Trajectory,
    open_recording,
)
from sphereflow.dense_errors import ErrorByStd
from sphereflow.errors import DataError, ValueRangeError
from sphereflow.report import finite
from sphereflow.result_folder import REPORT, ResultFolder

_Image = NDArray[np.float32]

_FARTHEST_STEP_RAD = 0.15
"""Place over range between two images up to which the filter was seen to find its way.

On simulated rooms, from a metre everywhere at the start, it does up to 0.12, and its deviations
say how well. Five real views half a metre apart it took for a wall just before the
lens, and was sure of it.
"""

_COLUMNS = (
    "stamp_ns",
    "status",
    "reason",
    "known_share",
    "compared_share",
    "median_percent",
    "mean_percent",
    "normalised",
)


def measure_depth(
    data: str | Path,
    trajectory: Trajectory,
    out: str | Path,
    *,
    calibration: str | Path | None = None,
    offset_s: float = 0.0,
    max_frames: int | None = None,
    std_percent: float = 10.0,
    position_sigma_m: float = 0.002,
    rotation_sigma_rad: float = 0.002,
    overwrite: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Run `DepthFilter` over a recording and write what it finds.

    Parameters
    ----------
    data
        Folder of a data set with colour images and a camera.
    trajectory
        Poses, world from camera. Frames without a pose are left out, and counted.
    out
        Folder to be made: ``depth`` (a TUM recording of the estimate), ``errors.csv``,
        ``report.json``.
    calibration
        Calibration file instead of the recording's own.
    offset_s
        Seconds that are added to an image's stamp to find its pose.
    max_frames
        Stop after so many frames.
    std_percent
        Pixels whose relative standard deviation is larger are unknown in the written depth.
    position_sigma_m, rotation_sigma_rad
        Standard deviation of a pose against the next ones; that of clock and shutter counts too.
    overwrite
        Replace an earlier result.
    progress
        Called with frames done and all frames.

    Returns
    -------
    dict
        What ``report.json`` holds.

    Raises
    ------
    DataError
        Without a camera, without images that have poses, or where these are too far apart for a
        video; nothing is then written.
    """
    if not 0 < std_percent < 1000:
        raise ValueRangeError(f"std_percent: expected above 0, below 1000, found {std_percent}")
    recording = open_recording(data, calibration=calibration)
    camera = recording.camera
    if camera is None:
        raise DataError(f"{recording.path}: expected a camera, found none (give a calibration)")
    count = len(recording) if max_frames is None else min(max_frames, len(recording))
    depth_filter = DepthFilter(camera, lags=_lags(recording.stamp_ns))
    axis = SphereGrid(camera).rays[..., 2].astype(np.float32)
    rows: list[dict[str, Any]] = []
    by_std = ErrorByStd()
    without_pose = 0
    steps_rad: list[float] = []
    place: NDArray[np.float64] | None = None
    with ResultFolder(out, overwrite=overwrite, protect=recording.path) as folder:
        writer = RecordingWriter(folder.path / "depth", camera, depth_scale=5000.0)
        for index, frame in enumerate(recording.frames(0, count)):
            if progress is not None:
                progress(index + 1, count)
            pose = trajectory.interpolate(frame.stamp_ns + round(offset_s * 1e9))
            if pose is None or frame.colour is None:
                without_pose += 1
                continue
            result = depth_filter.step(
                _grey(frame.colour),
                world_from_camera=pose,
                stamp_ns=frame.stamp_ns,
                position_sigma_m=position_sigma_m,
                rotation_sigma_rad=rotation_sigma_rad,
            )
            estimate, deviation = _depth(result, axis, std_percent)
            if place is not None:
                moved_m = float(np.linalg.norm(pose[:3, 3] - place))
                steps_rad.append(moved_m / float(np.nanmedian(result.range_m)))
            place = pose[:3, 3]
            if result.status != "skipped":
                writer.push(estimate, frame.stamp_ns, colour=frame.colour)
            if frame.depth_m is not None and recording.colour_registered:
                by_std.add(result.range_m * axis, frame.depth_m, deviation)
            rows.append(_row(frame, result, estimate, deviation, recording.colour_registered))
        if not rows:
            raise DataError(f"{recording.path}: expected images with poses, found none in {count}")
        _refuse_far_apart(recording.path, steps_rad)
        writer.finish()
        _write_table(folder.path / "errors.csv", rows)
        report = _report(rows, without_pose) | {"by_std": by_std.rows()}
        text = json.dumps(finite(report), indent=2, allow_nan=False)
        (folder.path / REPORT).write_text(text + "\n")
    return report


def _refuse_far_apart(path: Path, steps_rad: list[float]) -> None:
    middle = float(np.median(steps_rad)) if steps_rad else 0.0
    if middle > _FARTHEST_STEP_RAD:
        raise DataError(
            f"{path}: expected a video, whose camera moves by at most "
            f"{_FARTHEST_STEP_RAD:g} of the range from image to image, found {middle:.2f} "
            "(median): give the images in between"
        )


def _lags(stamp_ns: NDArray[np.int64]) -> list[int]:
    """The default's lags of 60 images a second in frames of this recording."""
    step_s = float(np.median(np.diff(stamp_ns))) * 1e-9 if len(stamp_ns) > 1 else 1 / 60
    return sorted({max(1, round(k / 60 / step_s)) for k in (1, 3, 7, 16, 32, 64)})


def _grey(colour: NDArray[np.uint8]) -> _Image:
    return (colour @ np.array([0.299, 0.587, 0.114], np.float32)).astype(np.float32)


def _depth(result: DepthResult, axis: _Image, std_percent: float) -> tuple[_Image, _Image]:
    """Depth along the axis where it is certain enough, and its relative deviation."""
    assert result.std_m is not None  # the filter's results have one
    deviation = result.std_m / result.range_m
    certain = (deviation < std_percent / 100) & (axis > 0)
    return np.where(certain, result.range_m * axis, np.nan).astype(np.float32), deviation


def _row(
    frame: Frame, result: DepthResult, estimate: _Image, deviation: _Image, registered: bool
) -> dict[str, Any]:
    known = np.isfinite(estimate)
    row: dict[str, Any] = {
        "stamp_ns": frame.stamp_ns,
        "status": result.status,
        "reason": result.reason or "",
        "known_share": float(known.mean()),
    }
    truth = frame.depth_m
    if truth is None or not registered or result.status == "skipped":
        return row
    true = np.isfinite(truth)
    both = known & true
    if not both.any():
        return row
    relative = np.abs(estimate[both] / truth[both] - 1)
    return row | {
        "compared_share": float(both.sum() / true.sum()),
        "median_percent": 100 * float(np.median(relative)),
        "mean_percent": 100 * float(relative.mean()),
        "normalised": float(np.median(relative / deviation[both]) / 0.6745),
    }


def _write_table(path: Path, rows: list[dict[str, Any]]) -> None:
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, _COLUMNS, restval="")
        writer.writeheader()
        writer.writerows(rows)


def _report(rows: list[dict[str, Any]], without_pose: int) -> dict[str, Any]:
    compared = [row for row in rows if "median_percent" in row and row["status"] == "updated"]

    def middle(key: str) -> float:
        return float(np.median([row[key] for row in compared]))

    keys = ("median_percent", "mean_percent", "compared_share", "normalised")
    return {
        "frames": len(rows),
        "without_pose": without_pose,
        "statuses": dict(Counter(row["status"] for row in rows)),
        "error": {key: middle(key) for key in keys} if compared else None,
    }
