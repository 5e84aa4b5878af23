//! The map: for now a coloured, voxel-thinned cloud built from depth and estimated poses.
