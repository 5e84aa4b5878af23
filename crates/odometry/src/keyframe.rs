//! Keyframes: frames that later ones are aligned to, so that errors do not add up frame by frame.

use crate::Result;
use nalgebra::Matrix6;
use sphereflow_alignment::FramePyramid;
use sphereflow_core::checks::{each, positive, share};
use sphereflow_core::{Pose, Stamp, Twist};

/// When a frame becomes a keyframe, and when an alignment is believed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyframePolicy {
    /// False measures every frame against the one before.
    pub enabled: bool,
    /// Below this share of the keyframe's surface within the image, the next keyframe is made.
    pub min_overlap: f64,
    /// Above this median displacement too, pixels of an image 640 pixels wide.
    pub max_flow_px: f64,
    /// Below this share, an alignment is not believed.
    pub least_overlap: f64,
    /// Largest distance between the predicted and the measured position, metres.
    pub max_surprise_m: f64,
}

impl Default for KeyframePolicy {
    fn default() -> Self {
        Self {
            enabled: true,
            min_overlap: 0.7,
            max_flow_px: 120.0,
            least_overlap: 0.3,
            max_surprise_m: 0.15,
        }
    }
}

impl KeyframePolicy {
    /// Checks every setting.
    ///
    /// # Errors
    /// A core value error naming the first setting out of its range.
    pub fn validate(&self) -> Result<()> {
        let shares = [
            ("min_overlap", self.min_overlap),
            ("least_overlap", self.least_overlap),
        ];
        each(share, &shares)?;
        let sizes = [
            ("max_flow_px", self.max_flow_px),
            ("max_surprise_m", self.max_surprise_m),
        ];
        each(positive, &sizes)
    }
}

/// How a frame was measured: its pose relative to its keyframe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyframeMotion {
    /// Number of the keyframe, from 0.
    pub keyframe: usize,
    /// Pose of the camera in the keyframe's frame.
    pub keyframe_from_camera: Pose,
    /// Covariance of `[rotation, translation]`, radians and metres, in the keyframe's frame.
    pub covariance: Matrix6<f64>,
}

/// A keyframe as the odometry tells of it: a new one, or a better image of one told before.
#[derive(Clone, Debug)]
pub struct KeyframeEvent {
    /// Number of the keyframe, from 0, in the order in which they are made. One that was told before
    /// has a better image now: its rolling shutter is undone; nothing else of it changes.
    pub index: usize,
    /// Its stamp.
    pub stamp: Stamp,
    /// The chain of measurements that it belongs to.
    pub segment: u32,
    /// Where it is, as far as known when it was made.
    pub world_from_keyframe: Pose,
    /// Its image without the finest level.
    pub image: FramePyramid,
    /// How it was measured against an earlier keyframe; `None` where the chain begins.
    pub parent: Option<KeyframeMotion>,
}

/// The frame that others are aligned to.
#[derive(Clone, Debug, Default)]
pub(crate) struct Keyframe {
    pub(crate) index: usize,
    pub(crate) stamp: Stamp,
    pub(crate) pose: Pose,
    /// As if all rows had been exposed at the stamp.
    pub(crate) image: FramePyramid,
    /// False where the velocity during its exposure was not yet known.
    pub(crate) shutter_undone: bool,
}

/// The last frame with a measured pose.
#[derive(Clone, Debug, Default)]
pub(crate) struct LastFrame {
    pub(crate) stamp: Stamp,
    pub(crate) pose: Pose,
    /// As it came from the camera.
    pub(crate) image: FramePyramid,
    /// Velocity up to this frame; zero before the second.
    pub(crate) twist: Twist,
    /// True where it is the keyframe itself.
    pub(crate) is_keyframe: bool,
    /// Its scene was divided: what it says of the motion may be that of an object.
    pub(crate) divided: bool,
}
