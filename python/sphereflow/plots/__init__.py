"""Pictures of results as PNG files, drawn without a window (extra ``plot``: matplotlib)."""

from sphereflow.plots.cloud import draw_cloud
from sphereflow.plots.depth import draw_depth
from sphereflow.plots.errors import draw_error
from sphereflow.plots.motion import draw_motion
from sphereflow.plots.run import draw_run
from sphereflow.plots.trajectory import draw_trajectories, draw_trajectory

__all__ = [
    "draw_cloud",
    "draw_depth",
    "draw_error",
    "draw_motion",
    "draw_run",
    "draw_trajectories",
    "draw_trajectory",
]
