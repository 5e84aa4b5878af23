"""The sphere of rays: cameras, the sphere grid and its calculus, rotations."""

from sphereflow._native import Camera, SphereGrid

__all__ = ["Camera", "SphereGrid"]
