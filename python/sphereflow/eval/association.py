"""Which pose of the reference and which of the estimate were taken at the same time."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

import sphereflow
from sphereflow.eval.arrays import Poses

Integers = NDArray[np.int64]
Association = Literal["one_to_one", "nearest"]
ASSOCIATIONS: tuple[Association, ...] = ("one_to_one", "nearest")


MAX_SECONDS = 4e9
"""Differences of stamps that can be meant: 1970 to 2096. Integer nanoseconds hold twice that."""

MAX_CANDIDATES = 4_000_000
"""Pairs sorted by their distance in time, 40 bytes each. Larger: more memory is used before a
tolerance that matches everything with everything is refused."""


def matched_pairs(
    reference: Poses,
    estimate: Poses,
    *,
    max_difference_s: float,
    offset_s: float,
    association: Association,
) -> Integers:
    """Rows of both trajectories taken at the same time, (K, 2): reference, estimate.

    ``one_to_one`` uses no pose twice and prefers the closest pairs (the rule of the TUM
    benchmark's own tools); ``nearest`` gives each pose of the shorter trajectory the nearest of the
    longer, which may serve several (evo's rule).

    Raises
    ------
    sphereflow.DataError
        Where no two poses are within ``max_difference_s``: the message tells both time spans.
    """
    if not 0.0 <= max_difference_s <= MAX_SECONDS:
        raise sphereflow.ValueRangeError(
            f"max_difference_s must be at least 0 seconds and at most {MAX_SECONDS:g}, "
            f"found {max_difference_s}"
        )
    if not abs(offset_s) <= MAX_SECONDS:
        raise sphereflow.ValueRangeError(
            f"offset_s must be within {MAX_SECONDS:g} seconds, found {offset_s}"
        )
    if association not in ASSOCIATIONS:
        raise sphereflow.ValueRangeError(
            f"association must be one of {', '.join(ASSOCIATIONS)}, found {association!r}"
        )
    for poses, name in ((reference, "reference"), (estimate, "estimate")):
        if len(poses) == 0:
            raise sphereflow.DataError(f"the {name} has no poses")
    shifted = estimate.stamp_ns + np.int64(round(offset_s * 1e9))
    if association == "nearest":
        found = sphereflow.associate(reference.stamp_ns, shifted, max_difference_s)
        pairs = np.asarray(found, dtype=np.int64).reshape(-1, 2)
    else:
        pairs = one_to_one(reference.stamp_ns, shifted, round(max_difference_s * 1e9))
    if len(pairs) == 0:
        raise sphereflow.DataError(
            f"no pose of the estimate ({_span(shifted)}) is within {max_difference_s:g} s of a "
            f"pose of the reference ({_span(reference.stamp_ns)}): are they of the same recording, "
            "and on the same clock?"
        )
    return pairs


def one_to_one(first_ns: Integers, second_ns: Integers, limit_ns: int) -> Integers:
    """Rows (K, 2) of two increasing lists, closest pairs first, none used twice.

    Of equally close pairs the later is preferred, so that the result is always the same one.
    """
    begin = np.searchsorted(second_ns, first_ns - limit_ns, side="left")
    end = np.searchsorted(second_ns, first_ns + limit_ns, side="right")
    counts = end - begin
    if counts.sum() > MAX_CANDIDATES:
        raise sphereflow.ValueRangeError(
            f"max_difference_s: {limit_ns * 1e-9:g} s puts {counts.sum()} pairs of poses near each "
            f"other, at most {MAX_CANDIDATES} are compared: lower it"
        )
    rows = np.repeat(np.arange(len(first_ns)), counts)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    columns = np.repeat(begin, counts) + within
    distance = np.abs(first_ns[rows] - second_ns[columns])
    order = np.lexsort((-columns, -rows, distance))
    free_row = np.ones(len(first_ns), dtype=bool)
    free_column = np.ones(len(second_ns), dtype=bool)
    pairs = []
    for row, column in zip(rows[order].tolist(), columns[order].tolist(), strict=True):
        if free_row[row] and free_column[column]:
            free_row[row] = free_column[column] = False
            pairs.append((row, column))
    return np.array(sorted(pairs), dtype=np.int64).reshape(-1, 2)


def _span(stamp_ns: Integers) -> str:
    return f"{seconds_text(int(stamp_ns[0]))} to {seconds_text(int(stamp_ns[-1]))} s"


def seconds_text(stamp_ns: int) -> str:
    """A stamp in seconds with nine decimals, made from the integer and not from a float."""
    sign = "-" if stamp_ns < 0 else ""
    whole, rest = divmod(abs(stamp_ns), 1_000_000_000)
    return f"{sign}{whole}.{rest:09d}"
