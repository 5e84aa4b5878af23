"""The few names of the compiled package that its Python face uses, in plain Python.

Tests of the face run with it where the compiled module is not built; with it built, the real ones
are used and this file does nothing.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np


class SphereflowError(Exception):
    pass


class ShapeError(SphereflowError, ValueError):
    pass


class ValueRangeError(SphereflowError, ValueError):
    pass


class DataError(SphereflowError, OSError):
    pass


@dataclass(frozen=True)
class Trajectory:
    stamp_ns: np.ndarray
    position_m: np.ndarray
    quat_xyzw: np.ndarray

    def __len__(self) -> int:
        return len(self.stamp_ns)

    @classmethod
    def read(cls, path, format=None):
        path = Path(path)
        if not path.is_file():
            raise DataError(f"{path}: no such file")
        if format == "euroc" or (format is None and path.suffix == ".csv"):
            rows = [line.split(",") for line in _lines(path)]
            stamps = [int(row[0]) for row in rows]
            values = np.array([row[1:8] for row in rows], dtype=float)
            return cls(np.array(stamps), values[:, :3], values[:, [4, 5, 6, 3]])
        rows = [line.split() for line in _lines(path)]
        if any(len(row) != 8 for row in rows):
            raise DataError(f"{path}: expected 8 numbers in each line")
        values = np.array([row[1:] for row in rows], dtype=float).reshape(-1, 7)
        stamps = np.array([_nanoseconds(row[0]) for row in rows], dtype=np.int64)
        return cls(stamps, values[:, :3], values[:, 3:])

    def write(self, path, format=None):
        seconds, rest = np.divmod(self.stamp_ns, 1_000_000_000)
        values = np.hstack([self.position_m, self.quat_xyzw])
        lines = [
            f"{a}.{b:09d} " + " ".join(f"{number:.9g}" for number in row)
            for a, b, row in zip(seconds, rest, values, strict=True)
        ]
        Path(path).write_text("\n".join(lines) + "\n")


def _lines(path: Path) -> list[str]:
    lines = path.read_text().splitlines()
    return [line for line in lines if line.strip() and not line.startswith("#")]


def _nanoseconds(text: str) -> int:
    if "e" in text:
        return round(float(text) * 1e9)
    whole, _, rest = text.partition(".")
    return int(whole) * 1_000_000_000 + int(rest.ljust(9, "0")[:9] or 0)


def associate(stamps_a_ns, stamps_b_ns, max_difference_s):
    """Nearest stamp of the longer list for each of the shorter one, in any case evo's rule."""
    swap = len(stamps_b_ns) > len(stamps_a_ns)
    short, long = (stamps_a_ns, stamps_b_ns) if swap else (stamps_b_ns, stamps_a_ns)
    limit = round(max_difference_s * 1e9)
    pairs = []
    for row, stamp in enumerate(short):
        other = int(np.argmin(np.abs(long - stamp)))
        if abs(int(long[other]) - int(stamp)) <= limit:
            pairs.append((row, other) if swap else (other, row))
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def _not_built(*arguments, **options):
    raise SphereflowError("the compiled module is not built")


MODULES = {
    "io": ("open_recording",),
    "odometry": ("DepthOdometry",),
    "slam": ("VoxelCloud",),
    "sim": ("demo",),
}


def install(package: ModuleType) -> None:
    """Put the names into ``package`` unless it has its own."""
    if hasattr(package, "Trajectory"):
        return
    for name in (
        "SphereflowError",
        "ShapeError",
        "ValueRangeError",
        "DataError",
        "Trajectory",
        "associate",
    ):
        setattr(package, name, globals()[name])
    for name, members in MODULES.items():
        module = ModuleType(f"{package.__name__}.{name}")
        for member in members:
            setattr(module, member, _not_built)
        sys.modules[module.__name__] = module
        setattr(package, name, module)
