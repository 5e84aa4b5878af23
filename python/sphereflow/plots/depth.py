"""A depth image in metres with its colour bar; unknown pixels are grey."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sphereflow.plots import canvas

UNKNOWN = "#b5b5b5"
SHOWN_PERCENT = (1.0, 99.0)
"""Colours span these percentiles, so that one far pixel does not make the room one colour."""


def draw_depth(path: str | Path, depth_m: NDArray[np.float32], *, title: str = "Depth") -> Path:
    """Draw depth (H, W) along the optical axis, metres, NaN where unknown."""
    figure, axis = canvas.figure(8.6, 6.0)
    known = np.isfinite(depth_m)
    limits: dict[str, Any] = {}
    if known.any():
        near, far = np.percentile(depth_m[known], SHOWN_PERCENT)
        limits = {"vmin": near, "vmax": max(far, near + 1e-3)}
    image = axis.imshow(np.ma.masked_invalid(depth_m), cmap="turbo_r", **limits)
    image.set_cmap(image.get_cmap().with_extremes(bad=UNKNOWN))
    axis.grid(False)
    axis.set(
        title=f"{title}: {100.0 * known.mean():.1f} % of the pixels known (grey: unknown)",
        xlabel="column (pixels)",
        ylabel="row (pixels)",
    )
    bar = figure.colorbar(image, ax=axis, shrink=0.85, extend="both")
    bar.set_label("depth along the optical axis (m)")
    return canvas.save(figure, path)
