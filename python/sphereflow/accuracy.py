"""Errors of a run against the truth: of the final trajectory and of the odometry before it."""

from __future__ import annotations

from typing import Any

import sphereflow
from sphereflow import eval as evaluation
from sphereflow.eval.relations import Relation
from sphereflow.journal import Journal

TRUTH_DIFFERENCE_S = 0.02
"""Frames further than this from a true pose are not compared: half a frame at 25 Hz."""

RELATIONS: dict[str, Relation] = {
    "rpe_1s_translation": "translation",
    "rpe_1s_rotation": "rotation_deg",
}

Errors = dict[str, evaluation.PoseError | str]
"""Results by name, or a text that says why there is none."""


def errors_of(journal: Journal, truth: Any) -> Errors:
    """Errors of ``trajectory`` and, named ``odometry_...``, of the poses as they were measured.

    Nothing where there is no truth.
    """
    if truth is None:
        return {}
    trajectory, odometry = journal.trajectory(), journal.odometry()
    if trajectory is None or odometry is None:
        return {"ape": "no frame has a pose"}
    final = _errors(truth, trajectory)
    measured = _errors(truth, odometry) if journal.corrected else final
    return final | {f"odometry_{name}": error for name, error in measured.items()}


def _errors(truth: Any, trajectory: sphereflow.Trajectory) -> Errors:
    errors: Errors = {}
    limit = TRUTH_DIFFERENCE_S
    try:
        errors["ape"] = evaluation.ape(truth, trajectory, max_difference_s=limit)
    except sphereflow.SphereflowError as error:
        errors["ape"] = str(error)
    for name, relation in RELATIONS.items():
        try:
            errors[name] = evaluation.rpe(
                truth,
                trajectory,
                delta=1.0,
                delta_unit="s",
                all_pairs=True,
                relation=relation,
                max_difference_s=limit,
            )
        except sphereflow.SphereflowError as error:
            errors[name] = str(error)
    return errors
