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
