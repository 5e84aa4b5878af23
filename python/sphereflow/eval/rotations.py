"""Rotations of many poses at once: quaternions (xyzw) to matrices, products, angles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def matrices_from_quat_xyzw(quat_xyzw: Array) -> Array:
    """Rotation matrices (N, 3, 3) of unit quaternions (N, 4) in the order x, y, z, w."""
    x, y, z, w = quat_xyzw.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def quat_xyzw_from_matrix(rotation: Array) -> Array:
    """Unit quaternion (4,), x y z w with w >= 0, of one rotation matrix (3, 3)."""
    m = rotation
    # The eigenvector of the largest eigenvalue is the closest quaternion (Bar-Itzhack): it has no
    # special cases at half turns and forgives a matrix that is only nearly orthogonal.
    k = np.array(
        [
            [m[0, 0] - m[1, 1] - m[2, 2], 0, 0, 0],
            [m[0, 1] + m[1, 0], m[1, 1] - m[0, 0] - m[2, 2], 0, 0],
            [m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], m[2, 2] - m[0, 0] - m[1, 1], 0],
            [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], m[0, 0] + m[1, 1] + m[2, 2]],
        ]
    )
    quat: Array = np.linalg.eigh(k, UPLO="L")[1][:, -1]
    return -quat if quat[3] < 0 else quat


def angles_rad(rotations: Array) -> Array:
    """Angles (N,) in [0, pi] of rotation matrices (N, 3, 3), accurate near 0 and near pi."""
    axis = np.stack(
        [
            rotations[:, 2, 1] - rotations[:, 1, 2],
            rotations[:, 0, 2] - rotations[:, 2, 0],
            rotations[:, 1, 0] - rotations[:, 0, 1],
        ],
        axis=1,
    )
    twice_sine = np.linalg.norm(axis, axis=1)
    twice_cosine = np.trace(rotations, axis1=1, axis2=2) - 1.0
    angles: Array = np.arctan2(twice_sine, twice_cosine)
    return angles


def relative(first: Array, second: Array) -> Array:
    """``first^T second`` for each pair of rotation matrices (N, 3, 3)."""
    product: Array = np.matmul(np.swapaxes(first, 1, 2), second)
    return product
