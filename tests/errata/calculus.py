"""Quaternions and differences on the unit sphere, as plain as can be: what the errata are shown by.

Quaternions have their scalar part first and multiply as Hamilton's; `q` turns body into world.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
STEP = 1e-5  # of central differences: truncation 1e-10, rounding 1e-11 for values of order 1


def product(p: Floats, q: Floats) -> Floats:
    """The product of two quaternions."""
    return np.concatenate(
        [[p[0] * q[0] - p[1:] @ q[1:]], p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])]
    )


def conjugate(q: Floats) -> Floats:
    """q*."""
    return q * np.array([1.0, -1, -1, -1])


def pure(x: Floats) -> Floats:
    """A vector as a quaternion."""
    return np.concatenate([[0.0], x])


def turned(q: Floats, x: Floats) -> Floats:
    """q x q*."""
    return product(product(q, pure(x)), conjugate(q))[1:]


def turn(vector: Floats) -> Floats:
    """The unit quaternion of a rotation vector."""
    angle = np.linalg.norm(vector)
    half = np.sinc(angle / (2 * np.pi)) / 2
    return np.concatenate([[np.cos(angle / 2)], half * vector])


def matrix(q: Floats) -> Floats:
    """The matrix of x -> q x q*."""
    return np.stack([turned(q, axis) for axis in np.eye(3)], axis=1)


def hat(w: Floats) -> Floats:
    """The matrix of x -> w x x."""
    return np.cross(w, np.eye(3), axisb=0, axisc=0)


def tangents(ray: Floats) -> Floats:
    """Two unit vectors that span the tangent plane of the sphere at a ray, (2, 3)."""
    return np.linalg.svd(ray[None])[2][1:]


def gradient(f: Callable[[Floats], float], ray: Floats, step: float = STEP) -> Floats:
    """Riemannian gradient on the sphere by differences along great circles."""
    return sum(
        e * (f(moved(ray, step * e)) - f(moved(ray, -step * e))) / (2 * step) for e in tangents(ray)
    )


def divergence(u: Callable[[Floats], Floats], ray: Floats, step: float = STEP) -> float:
    """Divergence on the sphere of a field of tangent vectors, by the same differences."""
    return sum(
        e @ (u(moved(ray, step * e)) - u(moved(ray, -step * e))) / (2 * step) for e in tangents(ray)
    )


def moved(ray: Floats, along: Floats) -> Floats:
    """The ray at an angle |along| from `ray`."""
    angle = np.linalg.norm(along)
    return np.cos(angle) * ray + np.sinc(angle / np.pi) * along


def sphere(rings: int = 24) -> tuple[Floats, Floats]:
    """Rays and weights of a product rule that is exact for polynomials up to degree 2 rings - 1."""
    z, weights = np.polynomial.legendre.leggauss(rings)
    angles = 2 * np.pi * (np.arange(2 * rings) + 0.5) / (2 * rings)
    z, angle = np.meshgrid(z, angles, indexing="ij")
    rho = np.sqrt(1 - z**2)
    rays = np.stack([rho * np.cos(angle), rho * np.sin(angle), z], axis=-1).reshape(-1, 3)
    return rays, np.repeat(weights, 2 * rings) * np.pi / rings


AXES = np.array([2.0, 1.6, 2.5])  # of the smooth convex room of the tests, metres


def room_range(centre: Floats, world_from_camera: Floats, ray: Floats) -> float:
    """Exact range along a ray of the camera frame inside the ellipsoid of AXES, metres."""
    direction, start = (world_from_camera @ ray) / AXES, centre / AXES
    a, b, c = direction @ direction, direction @ start, start @ start - 1
    return float((-b + np.sqrt(b * b - a * c)) / a)


def room_brightness(centre: Floats, world_from_camera: Floats, ray: Floats) -> float:
    """Painting of the wall that a ray of the camera frame meets."""
    point = centre + room_range(centre, world_from_camera, ray) * (world_from_camera @ ray)
    return float(np.sin(2 * point[0]) + np.cos(3 * point[1] + 0.5) * point[2])


def ray_of(z: Floats) -> Floats:
    """Unit ray of the pinhole coordinates (z1, z2)."""
    return np.array([z[0], z[1], 1.0]) / np.sqrt(1 + z @ z)


def slopes(f: Callable[[Floats], float], z: Floats, step: float = STEP) -> Floats:
    """Partial derivatives by differences."""
    return np.array(
        [(f(z + step * axis) - f(z - step * axis)) / (2 * step) for axis in np.eye(len(z))]
    )


def flow_parts(z: Floats, v: Floats, w: Floats) -> tuple[Floats, Floats]:
    """f and g of (2.11)."""
    n = np.sqrt(1 + z @ z)
    f = np.array(
        [
            z[0] * z[1] * w[0] - (1 + z[0] ** 2) * w[1] + z[1] * w[2],
            (1 + z[1] ** 2) * w[0] - z[0] * z[1] * w[1] - z[0] * w[2],
        ]
    )
    return f, n * np.array([-v[0] + z[0] * v[2], -v[1] + z[1] * v[2]])


def generator(alpha: Floats) -> Floats:
    """The matrix of [omega, v] in the Lie algebra of SE(3)."""
    out = np.zeros((4, 4))
    out[:3, :3], out[:3, 3] = hat(alpha[:3]), alpha[3:]
    return out
