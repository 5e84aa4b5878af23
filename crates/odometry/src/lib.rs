//! Trajectory of a camera from its depth images: frames aligned to keyframes, one after the other.
//!
//! [`DepthOdometry`] chains the alignments of `sphereflow-alignment` into a trajectory. All works on
//! the sphere of rays, so any central camera will do. Twists are `[omega, v]` in the camera's own
//! frame (x right, y down, z forward).

mod keyframe;
mod odometry;

pub use keyframe::{KeyframeEvent, KeyframeMotion, KeyframePolicy};
pub use odometry::{DepthOdometry, Gyro, OdometryConfig, OdometryResult, Timings};

/// Result of the crate's fallible calls: a core error names the argument, what was expected and
/// what was found. A frame that cannot be used is no error but a status.
pub use sphereflow_core::Result;
