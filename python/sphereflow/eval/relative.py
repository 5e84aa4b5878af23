"""Relative pose error: how much the motion over a step differs from the true motion (drift)."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

import sphereflow
from sphereflow.eval.alignment import Align, alignment
from sphereflow.eval.arrays import Poses, TrajectoryLike, checked_poses
from sphereflow.eval.association import Association, matched_pairs
from sphereflow.eval.pairs import DeltaUnit, pose_pairs
from sphereflow.eval.relations import UNITS, Relation, checked_relation, error_sizes
from sphereflow.eval.result import PoseError, Statistics
from sphereflow.eval.rotations import relative

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


def rpe(
    reference: TrajectoryLike,
    estimate: TrajectoryLike,
    *,
    delta: float = 1.0,
    delta_unit: DeltaUnit = "frames",
    relation: Relation = "translation",
    align: Align = "none",
    all_pairs: bool = False,
    delta_tolerance: float = 0.1,
    pairs_from: Literal["estimate", "reference"] = "estimate",
    max_difference_s: float = 0.01,
    offset_s: float = 0.0,
    association: Association = "one_to_one",
) -> PoseError:
    """Relative pose error, as ``evo_rpe`` defines it.

    Parameters
    ----------
    reference, estimate
        Truth and estimate.
    delta, delta_unit
        Length of a step: ``frames`` (of the matched poses), ``s``, ``m`` along the path, ``rad``
        or ``deg`` of turning. Seconds are ours, the others evo's.
    relation
        As in :func:`ape`; ``distance`` compares only how far the camera went, in metres, and
        ``distance_percent`` gives that as a share of the true distance (steps without true motion
        are left out).
    align
        As in :func:`ape`. A rigid alignment changes no relative error; a scale does.
    all_pairs, delta_tolerance
        Every pose may begin a pair instead of consecutive pairs; lengths within this share of
        ``delta`` are accepted.
    pairs_from
        The trajectory in which ``delta`` is measured.
    max_difference_s, offset_s, association
        As in :func:`ape`.

    Returns
    -------
    PoseError
        One error per pair; ``spans`` has the pairs.

    Raises
    ------
    sphereflow.DataError
        Where the two do not overlap in time or no pair is ``delta`` apart.
    sphereflow.ValueRangeError
        Where an option has a value that does not exist.
    """
    checked_relation(relation, tuple(UNITS))
    if pairs_from not in ("estimate", "reference"):
        raise sphereflow.ValueRangeError(
            f"pairs_from must be 'estimate' or 'reference', found {pairs_from!r}"
        )
    all_reference = checked_poses(reference, "reference")
    all_estimate = checked_poses(estimate, "estimate")
    matches = matched_pairs(
        all_reference,
        all_estimate,
        max_difference_s=max_difference_s,
        offset_s=offset_s,
        association=association,
    )
    truth, matched = all_reference.take(matches[:, 0]), all_estimate.take(matches[:, 1])
    found = alignment(truth, matched, align)
    aligned = found.poses(matched)
    spans = pose_pairs(
        aligned if pairs_from == "estimate" else truth,
        delta=delta,
        delta_unit=delta_unit,
        all_pairs=all_pairs,
        tolerance=delta_tolerance,
    )
    error, spans = _errors(relation, truth, aligned, spans)
    chosen = "all pairs" if all_pairs else "consecutive pairs"
    return PoseError(
        metric="rpe",
        relation=relation,
        unit=UNITS[relation],
        error=error,
        stamp_ns=matched.stamp_ns[spans[:, 1]],
        statistics=Statistics.of(error),
        align=align,
        alignment=found,
        matches=matches,
        spans=spans,
        reference_position_m=truth.position_m,
        estimate_position_m=aligned.position_m,
        description=(
            f"relative pose error, {relation}, over {delta:g} {delta_unit}, {chosen}, align {align}"
        ),
    )


def _errors(
    relation: Relation, truth: Poses, estimate: Poses, spans: Integers
) -> tuple[Array, Integers]:
    """Errors of the pairs, and the pairs that have one."""
    if relation in ("distance", "distance_percent"):
        true_m, found_m = _distances(truth, spans), _distances(estimate, spans)
        error = np.abs(true_m - found_m)
        if relation == "distance":
            return error, spans
        moved = true_m > 0.0
        if not moved.any():
            raise sphereflow.DataError(
                "the reference does not move over any step: no share of a distance exists"
            )
        return 100.0 * error[moved] / true_m[moved], spans[moved]
    true_rotation, true_m = _motions(truth, spans)
    found_rotation, found_m = _motions(estimate, spans)
    rotation = relative(true_rotation, found_rotation)
    offset_m = np.einsum("nji,nj->ni", true_rotation, found_m - true_m)
    return error_sizes(relation, rotation, offset_m), spans


def _distances(poses: Poses, spans: Integers) -> Array:
    lengths: Array = np.linalg.norm(
        poses.position_m[spans[:, 1]] - poses.position_m[spans[:, 0]], axis=1
    )
    return lengths


def _motions(poses: Poses, spans: Integers) -> tuple[Array, Array]:
    """Later camera seen from the earlier one: rotations (K, 3, 3), translations (K, 3)."""
    first, second = spans[:, 0], spans[:, 1]
    start = poses.rotation[first]
    moved = poses.position_m[second] - poses.position_m[first]
    return relative(start, poses.rotation[second]), np.einsum("nji,nj->ni", start, moved)
