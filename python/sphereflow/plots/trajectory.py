"""The path of the camera in three views, against the truth where there is one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sphereflow.plots import canvas

Array = NDArray[np.float64]
World = Literal["camera", "xyz"]


class View(NamedTuple):
    """Two coordinates of a world, seen from one side."""

    title: str
    across: int
    up: int
    across_label: str
    up_label: str
    flip_up: bool


VIEWS: dict[World, tuple[View, View, View]] = {
    # x right, y down, z forward: the frame of the first camera.
    "camera": (
        View("from above", 0, 2, "x right (m)", "z forward (m)", False),
        View("from behind", 0, 1, "x right (m)", "y down (m)", True),
        View("from the right side", 2, 1, "z forward (m)", "y down (m)", True),
    ),
    "xyz": (
        View("x-y", 0, 1, "x (m)", "y (m)", False),
        View("x-z", 0, 2, "x (m)", "z (m)", False),
        View("y-z", 1, 2, "y (m)", "z (m)", False),
    ),
}


def draw_trajectory(
    path: str | Path,
    estimate_m: Array,
    *,
    truth_m: Array | None = None,
    gaps: NDArray[np.intp] | None = None,
    world: World = "camera",
    title: str = "Camera trajectory",
) -> Path:
    """Draw positions (N, 3) in metres in three views with equal axes.

    ``gaps`` are rows of the estimate before which frames were lost: the line is broken there and
    the last pose before it is marked.
    """
    figure, axes = canvas.figure(15, 5.2, ncols=3)
    breaks = np.array([], dtype=np.intp) if gaps is None else np.asarray(gaps, dtype=np.intp)
    for axis, view in zip(axes, VIEWS[world], strict=True):
        if truth_m is not None:
            _line(axis, truth_m, view, color=canvas.TRUTH, linewidth=1.2, label="truth", ls="--")
        for number, part in enumerate(np.split(estimate_m, breaks)):
            label = "estimate" if number == 0 else None
            _line(axis, part, view, color=canvas.ESTIMATE, linewidth=1.8, label=label)
        _mark(axis, estimate_m[:1], view, canvas.START, "o", "start")
        _mark(axis, estimate_m[-1:], view, canvas.END, "s", "end")
        if breaks.size:
            _mark(axis, estimate_m[breaks - 1], view, canvas.LOST, "x", "lost here")
        _finish(axis, view)
    _legend(figure, axes[0])
    figure.suptitle(title)
    return canvas.save(figure, path)


def draw_trajectories(path: str | Path, positions_m: Mapping[str, Array]) -> Path:
    """Draw several trajectories by name, in the axes of their files."""
    figure, axes = canvas.figure(15, 5.2, ncols=3)
    for axis, view in zip(axes, VIEWS["xyz"], strict=True):
        for name, points in positions_m.items():
            _line(axis, points, view, linewidth=1.5, label=name)
        _finish(axis, view)
    _legend(figure, axes[0])
    figure.suptitle("Trajectories")
    return canvas.save(figure, path)


def _line(axis: Any, points_m: Array, view: View, **style: Any) -> None:
    axis.plot(points_m[:, view.across], points_m[:, view.up], **style)


def _mark(axis: Any, points_m: Array, view: View, color: str, marker: str, label: str) -> None:
    across, up = points_m[:, view.across], points_m[:, view.up]
    axis.scatter(across, up, color=color, marker=marker, s=55, zorder=5, label=label)


def _finish(axis: Any, view: View) -> None:
    axis.set(title=view.title, xlabel=view.across_label, ylabel=view.up_label)
    axis.set_aspect("equal", adjustable="datalim")
    if view.flip_up:
        axis.invert_yaxis()


def _legend(figure: Any, axis: Any) -> None:
    handles, labels = axis.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 6))
