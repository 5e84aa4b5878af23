"""What a recording holds and whether it makes sense, without tracking it."""

from __future__ import annotations

from typing import Any

import numpy as np

import sphereflow
from sphereflow.interfaces import RecordingLike, distances_of
from sphereflow.report import calibration_of, streams_of, sync_of, timing_of_stamps

SAMPLED_FRAMES = 12
"""Frames looked at for the depth: spread evenly, enough for a histogram."""

PLAUSIBLE_MEDIAN_M = (0.1, 30.0)
"""A depth camera's scene has its median here; outside, the depth scale is the first suspect."""

USUAL_SCALES = {1000.0: "Kinect, RealSense, 7-Scenes", 5000.0: "TUM, ICL-NUIM"}


def inspect_recording(
    recording: RecordingLike, *, calibration: str | None = None
) -> dict[str, Any]:
    """Streams, rates, gaps, calibration and depth of a recording, as plain values.

    ``calibration`` is the file that it was opened with, if it was one.
    """
    found: dict[str, Any] = {
        "kind": recording.kind,
        "frames": len(recording),
        "timing": timing_of_stamps(recording.stamp_ns),
        "streams": streams_of(recording),
        "sync": sync_of(recording),
        "truth_poses": 0 if recording.truth is None else len(recording.truth.stamp_ns),
        "calibration": calibration_of(recording, calibration),
        "depth": depth_of(recording),
        "notes": [str(text) for text in getattr(recording, "notes", [])],
        "warnings": [str(text) for text in recording.warnings],
    }
    found["hints"] = hints(found)
    return found


def depth_of(recording: RecordingLike) -> dict[str, Any]:
    """Depth of frames spread over the recording: known share and percentiles in metres."""
    count = len(recording)
    chosen = np.unique(np.linspace(0, max(count - 1, 0), SAMPLED_FRAMES).astype(int))
    samples, known, pixels, unreadable = [], 0, 0, []
    for index in chosen.tolist() if count else []:
        try:
            frame = next(recording.frames(index, index + 1), None)
        except sphereflow.SphereflowError as error:
            unreadable.append(f"frame {index}: {error}")
            continue
        metres = None if frame is None else distances_of(frame)
        if metres is None:
            continue
        finite = metres[np.isfinite(metres)]
        known, pixels = known + finite.size, pixels + metres.size
        samples.append(finite)
    depth = np.concatenate(samples) if samples else np.zeros(0)
    percentiles = {}
    if depth.size:
        levels = (1, 25, 50, 75, 99)
        values = np.percentile(depth, levels)
        percentiles = {f"p{level}": float(v) for level, v in zip(levels, values, strict=True)}
    return {
        "frames_looked_at": len(chosen) if count else 0,
        "frames_with_depth": len(samples),
        "known_share": known / pixels if pixels else 0.0,
        "metres": percentiles,
        "unreadable": unreadable,
    }


def hints(found: dict[str, Any]) -> list[str]:
    """What looks wrong, and what to do about it."""
    texts = []
    depth, calibration = found["depth"], found["calibration"]
    if depth["frames_with_depth"] == 0:
        texts.append("no frame that was looked at has depth: only recordings with depth can be run")
    texts += _depth_scale_hints(depth["metres"], calibration["depth_scale_counts_per_m"])
    if calibration["model"] is None:
        texts.append("no calibration: give one with --calibration FILE")
    if depth["metres"] and depth["known_share"] < 0.2:
        texts.append(f"only {100 * depth['known_share']:.0f} % of the pixels have a depth")
    if found["timing"].get("not_increasing"):
        texts.append(f"{found['timing']['not_increasing']} times do not increase")
    if not calibration["colour_registered"]:
        texts.append("colour is not registered to depth: the map has no colours")
    return texts


def _depth_scale_hints(metres: dict[str, float], used: float | None) -> list[str]:
    """Whether the depth is that of a camera's surroundings, and which scale would make it so."""
    median = metres.get("p50")
    low, high = PLAUSIBLE_MEDIAN_M
    if median is None or used is None or low <= median <= high:
        return []
    others = [
        f"{scale:g} ({who}) would make it {median * used / scale:.3g} m"
        for scale, who in USUAL_SCALES.items()
        if low <= median * used / scale <= high
    ]
    hint = f"the median depth is {median:.4g} m: is the depth scale {used:g} right?"
    return [" ".join([hint, *others])]
