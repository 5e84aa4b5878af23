"""An empty figure in the house style, and its saving; matplotlib is imported here only."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any

import sphereflow

ESTIMATE = "#0b6fb8"
TRUTH = "#3a3a3a"
LOST = "#d1352b"
START = "#2a9d3a"
END = "#e07b00"
AXES = ("#c0392b", "#2a9d3a", "#0b6fb8")
STATUS = {
    "started": "#8e6bbf",
    "tracked": "#2a9d3a",
    "weak": "#e0a800",
    "lost": "#d1352b",
    "skipped": "#9a9a9a",
    "unreadable": "#000000",
}

LEGEND_ABOVE = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "ncols": 6, "frameon": False}

STYLE: dict[Any, Any] = {
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "axes.titlesize": 11,
}


def figure(width_in: float, height_in: float, **layout: Any) -> tuple[Any, Any]:
    """A figure and its axes from ``subplots(**layout)``, drawn by Agg: no window, no display."""
    try:
        import matplotlib as mpl
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise sphereflow.MissingExtraError(
            'matplotlib is not installed: pip install "sphereflow[plot]"'
        ) from error
    with mpl.rc_context(STYLE):
        # A figure of its own, not pyplot's: no global state, no backend of the user changed.
        made = Figure(figsize=(width_in, height_in), layout="constrained")
        FigureCanvasAgg(made)
        axes = made.subplots(**layout)
    return made, axes


def save(made: Any, path: str | Path) -> Path:
    """Write the figure as PNG beside ``path``, then rename."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".png", dir=path.parent)
    os.close(handle)
    try:
        made.savefig(name, format="png", dpi=120, facecolor="white")
        Path(name).chmod(0o644)
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
    return path
