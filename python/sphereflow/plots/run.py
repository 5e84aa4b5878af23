"""All pictures of one run, in one folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sphereflow
from sphereflow.eval import ape
from sphereflow.journal import Journal
from sphereflow.plots.cloud import draw_cloud
from sphereflow.plots.depth import draw_depth
from sphereflow.plots.errors import draw_error
from sphereflow.plots.motion import draw_motion
from sphereflow.plots.trajectory import draw_trajectory


def draw_run(
    folder: Path,
    *,
    journal: Journal,
    truth: Any,
    cloud: tuple[NDArray[np.float32], NDArray[np.uint8]],
    depth_m: NDArray[np.float32] | None,
    max_difference_s: float,
) -> list[Path]:
    """Draw what there is to draw: motion always, the rest where the run made it."""
    drawn = [draw_motion(folder / "velocities.png", journal)]
    trajectory = journal.trajectory()
    truth_m = None
    if trajectory is not None and truth is not None:
        try:
            error = ape(truth, trajectory, max_difference_s=max_difference_s)
        except sphereflow.SphereflowError:
            pass  # the report says why there is no error to draw
        else:
            drawn.append(draw_error(folder / "error.png", error))
            # The truth in the estimate's frame, so that right, down and forward mean something.
            truth_m = error.alignment.points_back(error.reference_position_m)
    if trajectory is not None:
        position_m = np.asarray(trajectory.position_m)
        picture = folder / "trajectory.png"
        gaps = rows_after_gap(journal)
        drawn.append(draw_trajectory(picture, position_m, truth_m=truth_m, gaps=gaps))
        if len(cloud[0]):
            drawn.append(draw_cloud(folder / "map.png", *cloud, path_m=position_m))
    if depth_m is not None:
        drawn.append(draw_depth(folder / "depth.png", depth_m))
    return drawn


def rows_after_gap(journal: Journal) -> NDArray[np.intp]:
    """Rows of the trajectory whose frame follows one that was lost or could not be read."""
    posed = np.flatnonzero(journal.has_pose)
    lost = np.array([status in ("lost", "unreadable") for status in journal.statuses], dtype=bool)
    lost_before = np.concatenate([[0], np.cumsum(lost)])[posed]
    return np.flatnonzero(np.diff(lost_before) > 0) + 1
