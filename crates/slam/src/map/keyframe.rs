//! A keyframe of the map: where it is, what it saw, and how it was measured.

use nalgebra::Matrix6;
use sphereflow_alignment::FramePyramid;
use sphereflow_core::{Pose, Stamp};
use sphereflow_odometry::{KeyframeEvent, KeyframeMotion};

/// A frame that later ones, and other keyframes, are aligned to.
#[derive(Clone, Debug)]
pub struct Keyframe {
    /// Its stamp.
    pub stamp: Stamp,
    /// Number of the chain of measurements that it belongs to.
    pub segment: u32,
    /// Where it is, corrected by [`super::Map::refine`].
    pub world_from_keyframe: Pose,
    /// Its image without the finest level, its rolling shutter undone.
    pub image: FramePyramid,
    /// How it was measured against an earlier keyframe before it became one; `None` where a chain
    /// of measurements begins.
    pub parent: Option<KeyframeMotion>,
    /// Covariance of its pose relative to the start of its segment, `[rotation, translation]` in
    /// its own frame, radians and metres: the measurements of its parents added up.
    pub covariance: Matrix6<f64>,
}

impl Keyframe {
    pub(super) fn of(event: KeyframeEvent, covariance: Matrix6<f64>) -> Self {
        Self {
            stamp: event.stamp,
            segment: event.segment,
            world_from_keyframe: event.world_from_keyframe,
            image: event.image,
            parent: event.parent,
            covariance,
        }
    }
}
