"""A slow, readable twin of the sphere grid: pixels as spherical polygons, fluxes by arcs."""

import numpy as np
import sphereflow as sf
from numpy.typing import NDArray

Array = NDArray[np.float64]


def corner_rays(camera: sf.Camera) -> Array:
    """Unit rays of the pixel corners, (H + 1, W + 1, 3)."""
    u, v = np.meshgrid(np.arange(camera.width + 1) - 0.5, np.arange(camera.height + 1) - 0.5)
    rays = camera.unproject(np.stack([u.ravel(), v.ravel()], axis=1))
    return rays.reshape(camera.height + 1, camera.width + 1, 3)


def triangle_area(a: Array, b: Array, c: Array) -> float:
    """Solid angle of a spherical triangle (Van Oosterom and Strackee 1983)."""
    triple = abs(np.dot(a, np.cross(b, c)))
    return 2 * np.arctan2(triple, 1 + a @ b + b @ c + c @ a)


def solid_angle(camera: sf.Camera) -> Array:
    """Steradians of each pixel, (H, W)."""
    rays = corner_rays(camera)
    areas = np.zeros((camera.height, camera.width))
    for y in range(camera.height):
        for x in range(camera.width):
            a, b, c, d = rays[y, x], rays[y, x + 1], rays[y + 1, x + 1], rays[y + 1, x]
            areas[y, x] = triangle_area(a, b, c) + triangle_area(a, c, d)
    return areas


def outward_normal_length(a: Array, b: Array, inside: Array) -> Array:
    """Integral of n dl along the arc from a to b, n pointing away from ``inside``."""
    normal = np.cross(a, b)
    normal *= np.arctan2(np.linalg.norm(normal), a @ b) / np.linalg.norm(normal)
    return -normal if normal @ inside > 0 else normal


def divergence_inside(camera: sf.Camera, field: Array) -> Array:
    """Divergence of a tangent field (H, W, 3) for all pixels but those at the border."""
    rays, areas = corner_rays(camera), solid_angle(camera)
    height, width = areas.shape
    result = np.full((height, width), np.nan)
    for y in range(1, height - 1):
        for x in range(1, width - 1):
            corners = [rays[y, x], rays[y, x + 1], rays[y + 1, x + 1], rays[y + 1, x]]
            middle = sum(corners)
            beside = [field[y - 1, x], field[y, x + 1], field[y + 1, x], field[y, x - 1]]
            flux = 0.0
            for i in range(4):
                a, b = corners[i], corners[(i + 1) % 4]
                value = 0.5 * (field[y, x] + beside[i])
                flux += value @ outward_normal_length(a, b, middle)
            result[y, x] = flux / areas[y, x]
    return result
