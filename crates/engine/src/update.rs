//! What the engine says of a frame at the moment it was pushed.

use nalgebra::Matrix6;
use sphereflow_core::{Pose, Stamp, TrackStatus, Twist};
use sphereflow_odometry::Timings;

/// One frame: its pose as published, never touched again.
#[derive(Clone, Debug, PartialEq)]
pub struct Update {
    /// The frame's stamp.
    pub stamp: Stamp,
    /// Pose of the camera. Only where [`TrackStatus::has_pose`] was it measured: a lost frame's is
    /// predicted, a skipped one's is that of the frame before.
    pub world_from_camera: Pose,
    /// Covariance of the pose relative to the start of its segment, `[rotation, translation]` in the
    /// current camera frame, radians and metres; NaN before the first measured pose.
    pub covariance: Matrix6<f64>,
    /// Measured or not, and why.
    pub status: TrackStatus,
    /// How well determined the motion is, 0 (some motion changes nothing) to 1 (Theorem 3); NaN where
    /// nothing was measured.
    pub quality: f64,
    /// Number of the chain of measurements, from 0: poses of different segments hang together by
    /// prediction only.
    pub segment: u32,
    /// True where a keyframe was made of this frame, or of the one before on its arrival.
    pub is_keyframe: bool,
    /// Number of the map's state that the pose is in: it grows when keyframes move.
    pub epoch: u64,
    /// Measured velocity since the last measured frame, camera's own frame; `None` where not
    /// measured.
    pub twist: Option<Twist>,
    /// Where the time went.
    pub timings: Timings,
}
