"""The map: a coloured, voxel-thinned cloud built from depth and estimated poses."""

from sphereflow._native import VoxelCloud

__all__ = ["VoxelCloud"]
