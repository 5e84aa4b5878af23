"""The rigid motion or similarity that best carries one set of points onto another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

import sphereflow
from sphereflow.eval.arrays import Poses

Array = NDArray[np.float64]
Align = Literal["se3", "sim3", "scale", "origin", "none"]
ALIGNMENTS: tuple[Align, ...] = ("se3", "sim3", "scale", "origin", "none")

FEWEST_POINTS = 3
"""Two points leave a rotation about the line through them free."""

FLATNESS_LIMIT = 1e-12
"""Second over first singular value of the covariance (squares of lengths): points closer to a line
than a millionth of its length leave a rotation free. Rounding is about 1e-16 of the first."""


@dataclass(frozen=True, slots=True)
class Alignment:
    """``reference = scale * rotation @ estimate + translation_m``."""

    rotation: Array
    translation_m: Array
    scale: float = 1.0

    @classmethod
    def identity(cls) -> Alignment:
        """No change."""
        return cls(np.eye(3), np.zeros(3))

    @property
    def matrix(self) -> Array:
        """Similarity as a matrix (4, 4), reference_from_estimate."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.scale * self.rotation
        matrix[:3, 3] = self.translation_m
        return matrix

    def points(self, position_m: Array) -> Array:
        """Points (N, 3) of the estimate's frame in the reference's."""
        moved: Array = self.scale * position_m @ self.rotation.T + self.translation_m
        return moved

    def points_back(self, position_m: Array) -> Array:
        """Points (N, 3) of the reference's frame in the estimate's."""
        moved: Array = (position_m - self.translation_m) @ self.rotation / self.scale
        return moved

    def poses(self, poses: Poses) -> Poses:
        """Poses of the estimate in the reference's frame; a scale leaves orientations alone."""
        rotation = np.matmul(self.rotation, poses.rotation)
        return Poses(poses.stamp_ns, self.points(poses.position_m), rotation)


def umeyama(source: ArrayLike, target: ArrayLike, *, with_scale: bool = False) -> Alignment:
    """Least-squares motion that carries ``source`` onto ``target``.

    Parameters
    ----------
    source, target
        Corresponding points in metres, (N, 3) each, at least three and not on one line.
    with_scale
        Estimate a scale too; otherwise it is exactly 1.

    Returns
    -------
    Alignment
        ``target ~ scale * rotation @ source + translation_m``.

    Raises
    ------
    sphereflow.ShapeError
        Where the shapes differ or are not (N, 3).
    sphereflow.DataError
        Where the points are too few, not finite, or on one line.

    Notes
    -----
    Umeyama, Least-squares estimation of transformation parameters between two point patterns,
    IEEE PAMI 13(4), 1991, eqs. (34)-(43).
    """
    source_m, target_m = _checked_points(source, target)
    source_mean, target_mean = source_m.mean(axis=0), target_m.mean(axis=0)
    source_centred, target_centred = source_m - source_mean, target_m - target_mean
    covariance = target_centred.T @ source_centred / len(source_m)
    left, singular, right = np.linalg.svd(covariance)
    if not singular[1] > FLATNESS_LIMIT * singular[0]:
        raise sphereflow.DataError(
            f"cannot align: the {len(source_m)} matched positions lie on one line or at one point, "
            "so a rotation about it is free (use align 'none' or 'origin')"
        )
    # Of the two orthogonal solutions the proper rotation, never the mirror image.
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(left) * np.linalg.det(right))])
    rotation = (left * signs) @ right
    variance = np.square(source_centred).sum() / len(source_m)
    scale = float((singular * signs).sum() / variance) if with_scale else 1.0
    return Alignment(rotation, target_mean - scale * rotation @ source_mean, scale)


def _checked_points(source: ArrayLike, target: ArrayLike) -> tuple[Array, Array]:
    source_m = np.asarray(source, dtype=np.float64)
    target_m = np.asarray(target, dtype=np.float64)
    if source_m.shape != target_m.shape or source_m.ndim != 2 or source_m.shape[1] != 3:
        raise sphereflow.ShapeError(
            f"source and target must both be (N, 3), found {source_m.shape} and {target_m.shape}"
        )
    if len(source_m) < FEWEST_POINTS:
        raise sphereflow.DataError(
            f"cannot align: {len(source_m)} matched positions, at least {FEWEST_POINTS} are needed"
        )
    if not (np.isfinite(source_m).all() and np.isfinite(target_m).all()):
        raise sphereflow.DataError("cannot align: some positions are not finite")
    return source_m, target_m


def alignment(reference: Poses, estimate: Poses, align: Align) -> Alignment:
    """The alignment that ``align`` names, from matched poses of equal number."""
    if align not in ALIGNMENTS:
        raise sphereflow.ValueRangeError(
            f"align must be one of {', '.join(ALIGNMENTS)}, found {align!r}"
        )
    if align == "none":
        return Alignment.identity()
    if align == "origin":
        rotation = reference.rotation[0] @ estimate.rotation[0].T
        translation = reference.position_m[0] - rotation @ estimate.position_m[0]
        return Alignment(rotation, translation)
    fitted = umeyama(estimate.position_m, reference.position_m, with_scale=align != "se3")
    if align == "scale":
        return Alignment(np.eye(3), np.zeros(3), fitted.scale)
    return fitted
