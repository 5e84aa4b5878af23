"""Reads the trajectory files that a verb is given."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Literal

import typer

import sphereflow


class Format(StrEnum):
    """Formats of trajectory files."""

    TUM = "tum"
    KITTI = "kitti"
    EUROC = "euroc"


FORMATS: dict[Format, Literal["tum", "kitti", "euroc"]] = {
    Format.TUM: "tum",
    Format.KITTI: "kitti",
    Format.EUROC: "euroc",
}


KITTI_COLUMNS = 12
"""Numbers of a row: a 3x4 matrix, and no time."""


def read_pair(ref: Path, est: Path) -> tuple[sphereflow.Trajectory, sphereflow.Trajectory]:
    """Read a truth and an estimate; two KITTI files, which have no time, must be of one length."""
    reference, estimate = read_trajectory(ref), read_trajectory(est)
    counts = len(reference.stamp_ns), len(estimate.stamp_ns)
    if counts[0] != counts[1] and _has_no_time(ref) and _has_no_time(est):
        raise sphereflow.DataError(
            f"{ref} has {counts[0]} poses and {est} has {counts[1]}, both without time (KITTI): "
            "which belongs to which is not known; write both as TUM files, with times"
        )
    return reference, estimate


def _has_no_time(path: Path) -> bool:
    """Whether the first row of a file is the twelve numbers of a KITTI pose."""
    with path.open(encoding="utf-8", errors="replace") as lines:
        rows = (line.split() for line in lines if line.strip() and not line.startswith("#"))
        return len(next(rows, [])) == KITTI_COLUMNS


def read_trajectory(path: Path, file_format: Format | None = None) -> sphereflow.Trajectory:
    """Read a file; rows whose time does not increase are left out, and said so.

    The library refuses such a file. Published files have such rows (motion capture repeats a stamp
    now and then), so the command reads on without them and tells how many there were.
    """
    known = None if file_format is None else FORMATS[file_format]
    trajectory, left_out = sphereflow.Trajectory.read_lenient(path, format=known)
    for what in left_out:
        typer.echo(f"warning: {path}: {what}", err=True)
    return trajectory
