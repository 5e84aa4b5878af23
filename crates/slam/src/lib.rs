//! The map: for now a coloured, voxel-thinned cloud built from depth and estimated poses.

mod cloud;
mod error;

pub use cloud::{CloudPoints, VoxelCloud};
pub use error::Error;

/// Result of the crate's fallible calls.
pub type Result<T> = std::result::Result<T, Error>;
