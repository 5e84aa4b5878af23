"""The error against the truth over time, with its statistics."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sphereflow.eval.result import PoseError
from sphereflow.plots import canvas

GAP_STEPS = 3.0
"""Median steps without an error after which the line is broken."""


def draw_error(path: str | Path, error: PoseError, *, title: str | None = None) -> Path:
    """Draw each error over time and how the errors are spread."""
    figure, (over_time, spread) = canvas.figure(12, 4.2, ncols=2, width_ratios=(3, 1), sharey=True)
    scale, unit = _readable(error)
    seconds = (error.stamp_ns - error.stamp_ns[0]) / 1e9
    values = error.error * scale
    # Nothing is known between two poses that are far apart: no line is drawn there.
    steps = np.diff(seconds)
    usual = float(np.median(steps)) if len(steps) else np.inf
    breaks = np.flatnonzero(steps > GAP_STEPS * usual) + 1
    parts = zip(np.split(seconds, breaks), np.split(values, breaks), strict=True)
    for at, heights in parts:
        over_time.plot(at, heights, color=canvas.ESTIMATE, linewidth=1.1)
        over_time.fill_between(at, heights, color=canvas.ESTIMATE, alpha=0.12)
    for name, style in (("rmse", "-"), ("median", ":")):
        level = getattr(error.statistics, name) * scale
        label = f"{name} {level:.3g} {unit}"
        over_time.axhline(level, color=canvas.LOST, linestyle=style, linewidth=1.2, label=label)
    over_time.set(xlabel="time since the first pose (s)", ylabel=f"error ({unit})", ylim=(0, None))
    over_time.legend(**canvas.LEGEND_ABOVE)
    over_time.set_title(title or error.description, loc="left")
    bins = min(40, max(5, int(np.sqrt(len(values)))))
    spread.hist(values, bins=bins, orientation="horizontal", color=canvas.ESTIMATE, alpha=0.75)
    what = "poses" if error.metric == "ape" else "pairs"
    spread.set(xlabel=f"number of {what}", title=f"{len(values)} {what}")
    return canvas.save(figure, path)


def _readable(error: PoseError) -> tuple[float, str]:
    """Factor and unit: millimetres where metres would be all zeros."""
    if error.unit == "m" and error.statistics.max < 0.1:
        return 1e3, "mm"
    return 1.0, error.unit or "norm"
