"""How the viewer is laid out when a recording of a run is opened."""

from __future__ import annotations

import importlib
from typing import Any


def blueprint(rr: Any) -> Any:
    """The world large, images beside it, velocities and statuses below."""
    made = importlib.import_module(f"{rr.__name__}.blueprint")
    top = made.Horizontal(
        made.Spatial3DView(origin="world", name="World"),
        made.Vertical(
            made.Spatial2DView(origin="world/camera/colour", name="Colour"),
            made.Spatial2DView(origin="world/camera/depth", name="Depth"),
        ),
        column_shares=[3, 1],
    )
    below = made.Horizontal(
        made.TimeSeriesView(origin="motion/linear_m_s", name="Linear velocity (m/s)"),
        made.TimeSeriesView(origin="motion/angular_rad_s", name="Angular velocity (rad/s)"),
        made.TimeSeriesView(origin="motion/quality", name="Quality"),
        made.TextLogView(origin="log", name="Status"),
    )
    return made.Blueprint(made.Vertical(top, below, row_shares=[3, 1]))
