"""Reads the trajectory files that a verb is given."""

from __future__ import annotations

import tempfile
from decimal import Decimal, InvalidOperation
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
    try:
        return sphereflow.Trajectory.read(path, format=known)
    except sphereflow.DataError as error:
        if "must increase" not in str(error):
            raise
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
        kept = increasing_rows(lines)
    with tempfile.TemporaryDirectory(prefix="sphereflow-") as folder:
        cleaned = Path(folder) / path.name
        cleaned.write_text("\n".join(kept) + "\n", encoding="utf-8")
        trajectory = sphereflow.Trajectory.read(cleaned, format=known)
    left_out = len(lines) - len(kept)
    rows = "row" if left_out == 1 else "rows"
    typer.echo(f"warning: {path}: {left_out} {rows} left out, the time does not increase", err=True)
    return trajectory


def increasing_rows(lines: list[str]) -> list[str]:
    """The lines without those rows whose first number is not above the last kept one's."""
    kept, last = [], None
    for line in lines:
        fields = line.replace(",", " ").split()
        try:
            stamp = Decimal(fields[0]) if fields else None
        except InvalidOperation:
            stamp = None  # a comment or a heading
        if stamp is not None:
            if last is not None and stamp <= last:
                continue
            last = stamp
        kept.append(line)
    return kept
