//! The map: keyframes whose poses fit what they see of each other, the frames that hang on them, and
//! a coloured cloud.

mod cloud;
mod config;
mod keyframe_clouds;
mod loops;
pub mod map;

pub use cloud::{CloudPoints, VoxelCloud};
pub use config::GraphConfig;
pub use keyframe_clouds::{CloudConfig, Distances, KeyframeClouds};
pub use map::{GraphReport, Keyframe, Map};

/// Result of the crate's fallible calls: a core error names the argument, what was expected and what
/// was found.
pub use sphereflow_core::Result;
