"""Rigid motions and twists: exponential, logarithm and angle, in NumPy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SMALL_RAD = 1e-6
"""Below, the series' first terms are exact to rounding."""


def cross_matrix(a: Array) -> Array:
    """The matrix of ``a x``."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def left_jacobian(rotation_vector: Array) -> Array:
    """V of ``p = V v`` in the exponential of SE(3)."""
    angle = float(np.linalg.norm(rotation_vector))
    k = cross_matrix(rotation_vector)
    if angle < SMALL_RAD:
        return np.eye(3) + 0.5 * k
    first = (1.0 - np.cos(angle)) / angle**2
    second = (angle - np.sin(angle)) / angle**3
    return np.eye(3) + first * k + second * (k @ k)


def rotation_vector(rotation: Array) -> Array:
    """Axis times angle of a rotation matrix, below pi."""
    sine = 0.5 * np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    length = float(np.linalg.norm(sine))
    angle = float(np.arctan2(length, 0.5 * (np.trace(rotation) - 1.0)))
    return sine if length < SMALL_RAD else sine * (angle / length)


def twist_of(first_from_second: Array, dt_s: float) -> tuple[Array, Array]:
    """``(v, omega)``, constant over the interval, in the first camera's frame: ``log / dt``."""
    turn = rotation_vector(first_from_second[:3, :3])
    moved = np.linalg.solve(left_jacobian(turn), first_from_second[:3, 3])
    return moved / dt_s, turn / dt_s


def motion_of(linear_m_s: Array, angular_rad_s: Array, dt_s: float) -> Array:
    """The motion ``first_from_second`` of a constant twist."""
    turn = np.asarray(angular_rad_s, float) * dt_s
    angle = float(np.linalg.norm(turn))
    k = cross_matrix(turn)
    if angle < SMALL_RAD:
        rotation = np.eye(3) + k
    else:
        rotation = (
            np.eye(3) + np.sin(angle) / angle * k + (1.0 - np.cos(angle)) / angle**2 * (k @ k)
        )
    motion = np.eye(4)
    motion[:3, :3] = rotation
    motion[:3, 3] = left_jacobian(turn) @ (np.asarray(linear_m_s, float) * dt_s)
    return motion


def inverse(motion: Array) -> Array:
    """The inverse of a rigid motion."""
    back = np.eye(4)
    back[:3, :3] = motion[:3, :3].T
    back[:3, 3] = -motion[:3, :3].T @ motion[:3, 3]
    return back
