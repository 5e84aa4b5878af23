"""The content of ``report.json``: what was read, what became of it, how long it took."""

from __future__ import annotations

import json
import math
import os
import platform
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sphereflow
from sphereflow.accuracy import Errors
from sphereflow.interfaces import RecordingLike
from sphereflow.journal import Journal
from sphereflow.settings import Settings, depth_corrected_of

SCHEMA = 3
"""Version of the report's layout; a key is never given another meaning under the same number."""

FRAME_GAP = 1.5
"""An interval longer than this many usual ones is a gap: one missing frame makes it 2."""

BURST_GAP = 5.0
"""The same for inertial samples, which arrive in bursts: uneven intervals are not yet gaps."""

Stamps = NDArray[np.int64]


def timing_of_stamps(stamp_ns: Stamps, *, gap_factor: float = FRAME_GAP) -> dict[str, Any]:
    """Duration, rate and gaps of a stream of increasing stamps, as plain values."""
    steps = np.diff(np.asarray(stamp_ns, dtype=np.int64)).astype(np.float64)
    positive = steps[steps > 0]
    if len(positive) == 0:
        return {"samples": len(stamp_ns), "duration_s": 0.0, "rate_hz": None, "gaps": None}
    # The larger of median and mean: in bursts most intervals are far shorter than the usual one.
    usual = max(float(np.median(positive)), float(np.mean(positive)))
    gaps = steps[steps > gap_factor * usual]
    return {
        "samples": len(stamp_ns),
        "duration_s": float(stamp_ns[-1] - stamp_ns[0]) / 1e9,
        "rate_hz": 1e9 / float(np.mean(positive)),
        "jitter_s": float(np.std(positive)) / 1e9,
        "not_increasing": int((steps <= 0).sum()),
        "gaps": {"count": len(gaps), "longest_s": float(gaps.max()) / 1e9 if len(gaps) else 0.0},
    }


def sync_of(recording: RecordingLike) -> dict[str, float] | None:
    """How colour and depth were paired in time, where the reader tells it."""
    sync = getattr(recording, "sync", None)
    return None if sync is None else {str(name): float(value) for name, value in sync.items()}


def streams_of(recording: RecordingLike) -> dict[str, Any]:
    """Timing of each inertial stream that has stamps of its own."""
    streams = {}
    for name in ("imu", "mag"):
        samples = getattr(recording, name, None) or {}
        stamps = samples.get("stamp_ns")
        if stamps is not None and len(stamps):
            streams[name] = timing_of_stamps(stamps, gap_factor=BURST_GAP)
    return streams


def calibration_of(recording: RecordingLike, file: str | None = None) -> dict[str, Any]:
    """The calibration used and where it is from: the file that was given, or in words."""
    camera, scale = recording.camera, recording.depth_scale
    model: dict[str, Any] = {"model": None, "width": None, "height": None, "parameters": {}}
    if camera is not None:
        parameters = {name: float(value) for name, value in dict(camera.parameters).items()}
        model = {
            "model": str(camera.model),
            "width": int(camera.width),
            "height": int(camera.height),
            "parameters": parameters,
        }
    return {
        "source": str(recording.calibration_source) if file is None else file,
        **model,
        "depth_scale_counts_per_m": None if scale is None else float(scale),
        "colour_registered": bool(recording.colour_registered),
        "readout_s": getattr(recording, "readout_s", None),
        "depth_corrected": depth_corrected_of(recording),
    }


def path_length_m(position_m: NDArray[np.float64]) -> float:
    """Length of the line through the positions (N, 3)."""
    return float(np.linalg.norm(np.diff(position_m, axis=0), axis=1).sum())


def peak_memory_bytes() -> int | None:
    """Most memory this process has held so far; None where the system does not tell."""
    try:
        import resource
    except ImportError:  # Windows has none
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return int(peak if sys.platform == "darwin" else 1024 * peak)


BUSY_STAGES = ("decode", "engine", "compare")
"""What tracking and mapping need; the rest is for looking at."""


def build_report(
    *,
    source: str,
    recording: RecordingLike,
    settings: Settings,
    journal: Journal,
    engine: Mapping[str, Any],
    seconds: Mapping[str, float],
    errors: Errors,
    points: int,
    warnings: list[str],
) -> dict[str, Any]:
    """The whole report as plain values; ``errors`` has results, or why there is none."""
    trajectory = journal.trajectory()
    frames = len(journal.entries)
    busy_s = sum(seconds.get(stage, 0.0) for stage in BUSY_STAGES)
    readout_s, readout_source = settings.readout_of(recording)
    return {
        "schema": SCHEMA,
        "versions": versions(),
        "input": {"source": source, "kind": recording.kind, "frames_available": len(recording)},
        "settings": settings.as_dict(),
        "method": settings.method,
        "readout_s": readout_s,
        "readout_source": readout_source,
        "depth_corrected": depth_corrected_of(recording),
        "frames": frames,
        "frames_with_depth": journal.with_depth,
        "frames_with_pose": int(journal.has_pose.sum()),
        "outcomes": journal.outcomes(),
        "coverage": journal.coverage,
        "coverage_weak": engine["coverage_weak"],
        "coverage_meaning": "frames with a pose / frames not skipped on purpose; coverage_weak: "
        "those whose motion is poorly determined",
        "segments": engine["segments"],
        "world": {"frame": engine["world"], "because": engine["world_because"]},
        "min_coverage": settings.min_coverage,
        "covered": bool(frames and journal.coverage >= settings.min_coverage),
        "keyframes": engine["keyframes"],
        "pose_graph": engine["graph"],
        "no_pose_graph_because": _no_graph(settings, engine),
        "timing": timing_of_stamps(journal.stamp_ns),
        "streams": streams_of(recording),
        "sync": sync_of(recording),
        "path_length_m": 0.0 if trajectory is None else path_length_m(trajectory.position_m),
        "map_points": points,
        "calibration": calibration_of(recording, settings.calibration),
        "warnings": {"count": len(warnings), "texts": warnings},
        "seconds": {name: float(value) for name, value in seconds.items()},
        "front_ms_per_frame": {
            name: total / max(journal.pushed, 1) for name, total in journal.timings_ms.items()
        },
        "frames_per_s": frames / busy_s if busy_s > 0.0 else None,
        "peak_memory_bytes": peak_memory_bytes(),
        "truth": {
            name: error if isinstance(error, str) else error.summary()
            for name, error in errors.items()
        },
    }


def _no_graph(settings: Settings, engine: Mapping[str, Any]) -> str | None:
    """Why keyframes were not compared, where they were not."""
    if engine["graph"] is not None:
        return None
    if not settings.pose_graph:
        return "not asked for"
    count = engine["keyframes"]
    return (
        "1 keyframe: nothing to compare" if count == 1 else f"{count} keyframes: nothing to compare"
    )


def versions() -> dict[str, str]:
    """Versions of everything that can change a number."""
    return {
        "sphereflow": str(getattr(sphereflow, "__version__", "unknown")),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "machine": platform.machine(),
    }


def write_report(path: str | Path, report: Mapping[str, Any]) -> None:
    """Write as JSON beside ``path``, then rename; numbers that are not finite become null."""
    path = Path(path)
    text = json.dumps(finite(report), indent=2, allow_nan=False, ensure_ascii=False)
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as stream:
            stream.write(text + "\n")
        Path(name).chmod(0o644)
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def finite(value: Any) -> Any:
    """The value with every number that is not finite replaced by None: JSON has no NaN."""
    if isinstance(value, Mapping):
        return {str(key): finite(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(inner) for inner in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
