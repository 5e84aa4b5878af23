"""Absolute pose error: how far each pose is from the truth after one alignment of the whole."""

from __future__ import annotations

import numpy as np

from sphereflow.eval.alignment import Align, alignment
from sphereflow.eval.arrays import TrajectoryLike, checked_poses
from sphereflow.eval.association import Association, matched_pairs
from sphereflow.eval.relations import OF_A_POSE, UNITS, Relation, checked_relation, error_sizes
from sphereflow.eval.result import PoseError, Statistics
from sphereflow.eval.rotations import relative


def ape(
    reference: TrajectoryLike,
    estimate: TrajectoryLike,
    *,
    align: Align = "se3",
    relation: Relation = "translation",
    max_difference_s: float = 0.01,
    offset_s: float = 0.0,
    association: Association = "one_to_one",
) -> PoseError:
    """Absolute pose error, as ``evo_ape`` defines it (with translations: the field's ATE).

    Parameters
    ----------
    reference, estimate
        Truth and estimate; the frames of their worlds may differ, their clocks may not.
    align
        ``se3`` least squares of the positions (evo ``-a``), ``sim3`` with a scale too (``-as``,
        for monocular estimates), ``scale`` only (``-s``), ``origin`` by the first matched pose,
        ``none`` (evo's default).
    relation
        ``translation`` and ``distance`` in metres, ``rotation_deg``, ``rotation_rad``, or the
        Frobenius norms ``rotation_matrix`` and ``full``.
    max_difference_s
        Poses further apart in time than this are not compared; evo's default is 0.01 s.
    offset_s
        Added to the estimate's times before they are compared.
    association
        ``one_to_one``: no pose is used twice (the TUM benchmark's rule); ``nearest``: evo's rule,
        which may use a pose of the longer trajectory several times.

    Returns
    -------
    PoseError
        One error per matched pose.

    Raises
    ------
    sphereflow.DataError
        Where the two do not overlap in time, or are too few or too straight to align.
    sphereflow.ValueRangeError
        Where an option has a value that does not exist.

    Examples
    --------
    >>> truth = sphereflow.Trajectory.read("groundtruth.txt")  # doctest: +SKIP
    >>> ape(truth, result.trajectory).statistics.rmse  # doctest: +SKIP
    0.013473
    """
    checked_relation(relation, OF_A_POSE)
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
    # The error motion is estimate^-1 * reference, as in evo; its translation is in the camera.
    offset_m = truth.position_m - aligned.position_m
    rotation = relative(aligned.rotation, truth.rotation)
    in_camera = np.einsum("nji,nj->ni", aligned.rotation, offset_m)
    error = error_sizes(relation, rotation, in_camera)
    return PoseError(
        metric="ape",
        relation=relation,
        unit=UNITS[relation],
        error=error,
        stamp_ns=matched.stamp_ns,
        statistics=Statistics.of(error),
        align=align,
        alignment=found,
        matches=matches,
        spans=None,
        reference_position_m=truth.position_m,
        estimate_position_m=aligned.position_m,
        description=f"absolute pose error, {relation}, align {align}",
    )
