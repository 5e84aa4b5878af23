//! What the odometry says of a frame.

use crate::keyframe::{KeyframeEvent, KeyframeMotion};
use nalgebra::Matrix6;
use sphereflow_alignment::VelocityEstimate;
use sphereflow_core::{Pose, Stamp, TrackStatus, Twist};

/// Seconds spent on one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Timings {
    /// Checks and block averages.
    pub averaging_s: f64,
    /// Weak form and robust solve.
    pub estimation_s: f64,
}

/// What became of one frame.
#[derive(Clone, Debug)]
pub struct OdometryResult {
    /// The frame's stamp.
    pub stamp: Stamp,
    /// Measured or not, and why. Only where [`TrackStatus::has_pose`] is the pose measured.
    pub status: TrackStatus,
    /// Pose of the camera; the world is the camera frame of the first frame. Where the frame was
    /// lost it is predicted with constant velocity, where skipped it is that of the frame before.
    pub world_from_camera: Pose,
    /// Measured velocity since the last measured frame, camera's own frame; `None` where not
    /// measured.
    pub twist: Option<Twist>,
    /// Covariance of the twist, order `[omega, v]`; `None` where not measured.
    pub covariance: Option<Matrix6<f64>>,
    /// Pose relative to the keyframe that it was measured against, with its covariance.
    pub keyframe_motion: Option<KeyframeMotion>,
    /// The measurement; `None` for the first frame and frames that were not compared.
    pub estimate: Option<VelocityEstimate>,
    /// Grows by one whenever the chain of measurements breaks: poses of different segments hang
    /// together by prediction only.
    pub segment: u32,
    /// Keyframes made since the last result, and better images of earlier ones.
    pub keyframes: Vec<KeyframeEvent>,
    /// Where the time went.
    pub timings: Timings,
}
