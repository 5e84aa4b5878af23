"""What is compared of two poses: evo's pose relations and their units."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

import sphereflow
from sphereflow.eval.rotations import angles_rad

Array = NDArray[np.float64]
Relation = Literal[
    "translation",
    "rotation_deg",
    "rotation_rad",
    "rotation_matrix",
    "full",
    "distance",
    "distance_percent",
]

UNITS: dict[Relation, str] = {
    "translation": "m",
    "rotation_deg": "deg",
    "rotation_rad": "rad",
    "rotation_matrix": "",
    "full": "",
    "distance": "m",
    "distance_percent": "%",
}
"""Unit of the error of each relation; the norms of matrix differences have none."""

OF_A_POSE: tuple[Relation, ...] = (
    "translation",
    "rotation_deg",
    "rotation_rad",
    "rotation_matrix",
    "full",
    "distance",
)
"""Relations that one pose against another has; a share of a distance needs two."""


def checked_relation(relation: Relation, allowed: tuple[Relation, ...]) -> Relation:
    """The relation, or an error that lists those that exist."""
    if relation not in allowed:
        raise sphereflow.ValueRangeError(
            f"relation must be one of {', '.join(allowed)}, found {relation!r}"
        )
    return relation


def error_sizes(relation: Relation, rotation: Array, translation_m: Array) -> Array:
    """Size (N,) of error motions: rotations (N, 3, 3) and translations (N, 3)."""
    off_identity = rotation - np.eye(3)
    turned_squares = np.square(off_identity).sum(axis=(1, 2))
    moved_squares = np.square(translation_m).sum(axis=1)
    sizes: Array
    match relation:
        case "rotation_rad":
            sizes = angles_rad(rotation)
        case "rotation_deg":
            sizes = np.rad2deg(angles_rad(rotation))
        case "rotation_matrix":
            sizes = np.sqrt(turned_squares)
        case "full":
            sizes = np.sqrt(turned_squares + moved_squares)
        case _:
            sizes = np.sqrt(moved_squares)
    return sizes
