"""Velocities, how well they are determined, and the status of every frame over time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sphereflow.journal import Journal
from sphereflow.plots import canvas

Array = NDArray[np.float64]
LINEAR = ("x right", "y down", "z forward")
ANGULAR = ("about x (right)", "about y (down)", "about z (forward)")


def draw_motion(path: str | Path, journal: Journal) -> Path:
    """Draw the run: linear and angular velocity in the camera's frame, score, status."""
    figure, axes = canvas.figure(12, 8.6, nrows=4, sharex=True, height_ratios=(3, 3, 1.6, 1.0))
    stamps = journal.stamp_ns
    seconds = (stamps - stamps[0]) / 1e9 if len(stamps) else np.zeros(0)
    linear, angular = journal.velocities
    _components(axes[0], seconds, linear, "linear velocity (m/s)", LINEAR)
    _components(axes[1], seconds, np.rad2deg(angular), "angular velocity (deg/s)", ANGULAR)
    axes[2].plot(seconds, journal.qualities, color=canvas.TRUTH, linewidth=1.0)
    axes[2].set(ylabel="score (0 to 1)", ylim=(0, None))
    _statuses(axes[3], seconds, journal.statuses)
    figure.suptitle(
        f"Motion in the camera's frame; {100.0 * journal.coverage:.1f} % of frames have a pose"
    )
    axes[3].set_xlabel("time since the first frame (s)")
    return canvas.save(figure, path)


def _components(
    axis: Any, seconds: Array, values: Array, label: str, names: tuple[str, ...]
) -> None:
    for column, (name, color) in enumerate(zip(names, canvas.AXES, strict=True)):
        axis.plot(seconds, values[:, column], color=color, linewidth=1.0, label=name)
    axis.axhline(0.0, color="#888888", linewidth=0.6)
    axis.set_ylabel(label)
    axis.legend(**canvas.LEGEND_ABOVE)


def _statuses(axis: Any, seconds: Array, statuses: list[str]) -> None:
    """A line of marks, one per frame, coloured by status; only those that occur are named."""
    found = np.array(statuses)
    for name, color in canvas.STATUS.items():
        here = seconds[found == name] if len(found) else seconds
        if len(here):
            label = f"{name} ({len(here)})"
            axis.scatter(here, np.zeros(len(here)), color=color, marker="|", s=320, label=label)
    axis.set(yticks=[], ylabel="status", ylim=(-1.0, 1.0))
    axis.grid(False)
    axis.legend(**canvas.LEGEND_ABOVE, markerscale=0.5)
