"""What the evaluation needs of a trajectory, checked once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

import sphereflow
from sphereflow.eval.rotations import matrices_from_quat_xyzw

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class TrajectoryLike(Protocol):
    """Anything with these three arrays, for example ``sphereflow.Trajectory``."""

    @property
    def stamp_ns(self) -> Any:
        """Times, integer nanoseconds (N,)."""

    @property
    def position_m(self) -> Any:
        """Positions of the camera in the world, metres (N, 3)."""

    @property
    def quat_xyzw(self) -> Any:
        """Orientations, world from camera, unit quaternions (N, 4)."""


@dataclass(frozen=True, slots=True)
class Poses:
    """Checked arrays of one trajectory; ``rotation`` is world from camera, (N, 3, 3)."""

    stamp_ns: Integers
    position_m: Array
    rotation: Array

    def __len__(self) -> int:  # noqa: D105
        return len(self.stamp_ns)

    def take(self, rows: Integers) -> Poses:
        """The poses of these rows."""
        return Poses(self.stamp_ns[rows], self.position_m[rows], self.rotation[rows])


MAX_POSITION_M = 1e15
"""A tenth of a light year. Much larger coordinates overflow when they are squared and summed."""


def checked_poses(trajectory: TrajectoryLike, name: str) -> Poses:
    """Arrays of ``trajectory``; errors call it ``name``.

    Raises
    ------
    sphereflow.ShapeError
        Where the three arrays do not belong together.
    sphereflow.DataError
        Where a number is not finite or a quaternion has no length, or time runs backwards.
    """
    stamp_ns = np.asarray(trajectory.stamp_ns)
    position_m = np.asarray(trajectory.position_m, dtype=np.float64)
    quat_xyzw = np.asarray(trajectory.quat_xyzw, dtype=np.float64)
    count = len(stamp_ns)
    found = (stamp_ns.shape, position_m.shape, quat_xyzw.shape)
    if found != ((count,), (count, 3), (count, 4)):
        raise sphereflow.ShapeError(
            f"{name}: expected stamp_ns (N,), position_m (N, 3) and quat_xyzw (N, 4), "
            f"found {found[0]}, {found[1]} and {found[2]}"
        )
    if not np.issubdtype(stamp_ns.dtype, np.integer):
        raise sphereflow.ShapeError(
            f"{name}: stamp_ns must be integer nanoseconds, found {stamp_ns.dtype}"
        )
    finite = np.isfinite(position_m).all(axis=1) & np.isfinite(quat_xyzw).all(axis=1)
    lengths = np.linalg.norm(quat_xyzw, axis=1)
    bad = np.flatnonzero(~finite | ~(lengths > 0.0))
    if bad.size:
        raise sphereflow.DataError(
            f"{name}: pose {bad[0]} has a number that is not finite or a quaternion of length 0 "
            f"({bad.size} of {count} poses do)"
        )
    if not np.abs(position_m).max(initial=0.0) <= MAX_POSITION_M:
        raise sphereflow.DataError(
            f"{name}: positions must be within {MAX_POSITION_M:g} m, found "
            f"{np.abs(position_m).max():g} m"
        )
    backwards = np.flatnonzero(np.diff(stamp_ns) < 0)
    if backwards.size:
        raise sphereflow.DataError(
            f"{name}: times must increase, but pose {backwards[0] + 1} is before the one it follows"
        )
    unit = quat_xyzw / lengths[:, None]
    return Poses(stamp_ns.astype(np.int64), position_m, matrices_from_quat_xyzw(unit))
