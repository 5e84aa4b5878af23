"""The map from above and from the side, coloured as seen, or by height where it has no colour."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sphereflow.plots import canvas
from sphereflow.plots.trajectory import VIEWS

MOST_POINTS = 300_000
"""More would only lie on top of one another, and take minutes to draw."""

INK = 200_000.0
SMALLEST_DOT, LARGEST_DOT = 0.6, 4.0
"""Area of all points on paper, and of one, in square points: few points are drawn larger."""

SHOWN_PERCENT = (0.5, 99.5)
"""The view spans these percentiles of the points; stray ones do not shrink the room."""


def draw_cloud(
    path: str | Path,
    xyz_m: NDArray[np.float32],
    rgb: NDArray[np.uint8],
    *,
    path_m: NDArray[np.float64] | None = None,
) -> Path:
    """Draw points (N, 3) in the first camera's frame (x right, y down, z forward), metres."""
    step = max(1, len(xyz_m) // MOST_POINTS)
    points, colours = np.asarray(xyz_m[::step], dtype=np.float64), rgb[::step]
    above, _, side = VIEWS["camera"]
    figure, axes = canvas.figure(14, 6.5, ncols=2)
    coloured = bool(colours.size) and bool(np.ptp(colours) > 0)
    dot = float(np.clip(INK / max(len(points), 1), SMALLEST_DOT, LARGEST_DOT))
    # Painter's order: what is nearer to the eye is drawn last, on top. The eye is above (small y)
    # in the one view and on the right (large x) in the other.
    for axis, view, nearness in (
        (axes[0], above, -points[:, 1]),
        (axes[1], side, points[:, 0]),
    ):
        order = np.argsort(nearness)
        shown = points[order]
        height = -shown[:, 1]
        paint = {"c": colours[order] / 255.0} if coloured else {"c": height, "cmap": "viridis"}
        dots = axis.scatter(shown[:, view.across], shown[:, view.up], s=dot, linewidths=0, **paint)
        if path_m is not None:
            axis.plot(path_m[:, view.across], path_m[:, view.up], color=canvas.LOST, linewidth=1.4)
        axis.set_facecolor("#f4f4f4")
        axis.set(title=f"{view.title}", xlabel=view.across_label, ylabel=view.up_label)
        axis.set_aspect("equal", adjustable="box")
        if len(points):
            axis.set_xlim(*_span(points, path_m, view.across))
            low, high = _span(points, path_m, view.up)
            axis.set_ylim(*((high, low) if view.flip_up else (low, high)))
    if not coloured and len(points):
        figure.colorbar(dots, ax=axes, shrink=0.7, label="height above the first camera (m)")
    figure.suptitle(
        f"Map: {len(xyz_m):,} points" + (", camera path in red" if path_m is not None else "")
    )
    return canvas.save(figure, path)


def _span(
    points: NDArray[np.float64], path_m: NDArray[np.float64] | None, column: int
) -> tuple[float, float]:
    """Limits of a view: nearly all of the points, and the whole path."""
    low, high = np.percentile(points[:, column], SHOWN_PERCENT)
    if path_m is not None and len(path_m):
        low, high = min(low, path_m[:, column].min()), max(high, path_m[:, column].max())
    margin = 0.04 * (high - low) + 0.05
    return float(low - margin), float(high + margin)
