"""Which pairs of poses the relative pose error compares: a step of frames, time, path or angle."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

import sphereflow
from sphereflow.eval.arrays import Poses
from sphereflow.eval.rotations import angles_rad, relative

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
DeltaUnit = Literal["frames", "s", "m", "rad", "deg"]
DELTA_UNITS: tuple[DeltaUnit, ...] = ("frames", "s", "m", "rad", "deg")


def pose_pairs(
    poses: Poses, *, delta: float, delta_unit: DeltaUnit, all_pairs: bool, tolerance: float
) -> Integers:
    """Rows (K, 2) of earlier and later poses that are ``delta`` apart, by evo's rules.

    Consecutive pairs share their ends: each begins where the last one ended, and ends with the
    first pose at which the path (or angle, or time) since reaches ``delta``. With ``all_pairs``
    each pose may begin a pair, whose length must be within ``tolerance * delta`` of ``delta``: for
    path and time the pose nearest to ``delta``, for angles every pose turned by ``delta`` directly.
    """
    _check(poses, delta, delta_unit, tolerance)
    if delta_unit == "frames":
        pairs = _by_index(len(poses), int(delta), all_pairs)
    elif delta_unit in ("rad", "deg"):
        angle_rad = np.deg2rad(delta) if delta_unit == "deg" else delta
        pairs = _by_angle(poses.rotation, angle_rad, tolerance * angle_rad, all_pairs)
    else:
        if delta_unit == "m":
            steps = np.linalg.norm(np.diff(poses.position_m, axis=0), axis=1)
        else:
            # Integer nanoseconds add up exactly, so a step of 1 s is found at 1 s.
            steps = np.diff(poses.stamp_ns).astype(np.float64)
        length = float(round(delta * 1e9)) if delta_unit == "s" else delta
        pairs = _nearest(steps, length, tolerance * length) if all_pairs else _greedy(steps, length)
    if len(pairs) == 0:
        raise sphereflow.DataError(
            f"no two of the {len(poses)} matched poses are {delta:g} {delta_unit} apart: "
            "lower delta" + (", or raise the tolerance" if all_pairs else "")
        )
    return pairs


def _check(poses: Poses, delta: float, delta_unit: DeltaUnit, tolerance: float) -> None:
    if delta_unit not in DELTA_UNITS:
        raise sphereflow.ValueRangeError(
            f"delta_unit must be one of {', '.join(DELTA_UNITS)}, found {delta_unit!r}"
        )
    if not delta > 0.0:
        raise sphereflow.ValueRangeError(f"delta must be above 0, found {delta}")
    if delta_unit == "frames" and delta != int(delta):
        raise sphereflow.ValueRangeError(f"delta must be a whole number of frames, found {delta}")
    half_turn = {"rad": np.pi, "deg": 180.0}.get(delta_unit, np.inf)
    if delta > half_turn:
        raise sphereflow.ValueRangeError(
            f"delta must be at most half a turn, {half_turn:g} {delta_unit}, found {delta}"
        )
    if not tolerance >= 0.0:
        raise sphereflow.ValueRangeError(f"delta_tolerance must be at least 0, found {tolerance}")
    if len(poses) < 2:
        raise sphereflow.DataError(
            f"{len(poses)} matched pose, at least 2 are needed for a relative error"
        )


def _by_index(count: int, delta: int, all_pairs: bool) -> Integers:
    first = np.arange(0, count - delta, 1 if all_pairs else delta, dtype=np.int64)
    return np.stack([first, first + delta], axis=1)


def _greedy(steps: Array, delta: float) -> Integers:
    """Consecutive pairs: end one as soon as the steps since its start sum to ``delta``."""
    ends, total = [0], 0.0
    for row, step in enumerate(steps, start=1):
        total += step
        if total >= delta:
            ends.append(row)
            total = 0.0
    return np.stack([ends[:-1], ends[1:]], axis=1).astype(np.int64)


def _nearest(steps: Array, delta: float, tolerance: float) -> Integers:
    """From each pose the later one whose distance along the steps is nearest to ``delta``."""
    along = np.concatenate([[0.0], np.cumsum(steps)])
    pairs = []
    for row in range(len(along) - 1):
        misses = np.abs(along[row + 1 :] - along[row] - delta)
        best = int(np.argmin(misses))
        if misses[best] <= tolerance:
            pairs.append((row, row + 1 + best))
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def _by_angle(rotation: Array, delta: float, tolerance: float, all_pairs: bool) -> Integers:
    if not all_pairs:
        return _greedy(angles_rad(relative(rotation[:-1], rotation[1:])), delta)
    pairs: list[tuple[int, int]] = []
    for row in range(len(rotation) - 1):
        turned = angles_rad(np.matmul(rotation[row].T, rotation[row + 1 :]))
        close = np.flatnonzero((turned >= delta - tolerance) & (turned <= delta + tolerance))
        pairs.extend((row, row + 1 + int(later)) for later in close)
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)
