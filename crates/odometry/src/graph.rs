//! The keyframes of a run, the frames that hang on them, and what is compared again at the end.

use crate::keyframe::KeyframeMotion;
use crate::odometry::OdometryResult;
use sphereflow_alignment::FramePyramid;
use sphereflow_core::{Pose, Reason, Stamp, TrackStatus};

/// Which pairs of keyframes are compared, and how far the comparison is trusted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GraphConfig {
    /// False keeps no keyframe images: [`crate::DepthOdometry::optimise`] then changes nothing.
    pub enabled: bool,
    /// Pairs turned by more than this are not compared, radians.
    pub max_angle_rad: f64,
    /// Pairs further apart are not compared, metres.
    pub max_distance_m: f64,
    /// Pairs that share less of their surface are not compared.
    pub min_overlap: f64,
    /// Largest number of earlier keyframes that one is compared with: those of most overlap.
    pub max_edges: usize,
    /// Standard deviations of a comparison beyond what its residuals show.
    pub floor_m: f64,
    /// The same for rotations, radians.
    pub floor_rad: f64,
    /// Rounds of comparing and solving.
    pub rounds: usize,
}

impl Default for GraphConfig {
    fn default() -> Self {
        Self {
            enabled: true,
            max_angle_rad: 0.6,
            max_distance_m: 0.8,
            min_overlap: 0.3,
            max_edges: 30,
            floor_m: 4e-3,
            floor_rad: 3e-3,
            rounds: 2,
        }
    }
}

/// A keyframe: its pose, and its image without the finest level.
#[derive(Clone, Debug)]
pub(crate) struct KeyframeNode {
    pub(crate) pose: Pose,
    pub(crate) image: FramePyramid,
    /// The keyframe that it was measured against before it became one itself.
    pub(crate) parent: Option<KeyframeMotion>,
}

/// A frame with a pose, relative to a keyframe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FrameNode {
    pub(crate) stamp: Stamp,
    pub(crate) keyframe: usize,
    pub(crate) keyframe_from_camera: Pose,
    /// World from camera as `push` gave it.
    pub(crate) measured: Pose,
}

/// All of them, in order.
#[derive(Clone, Debug, Default)]
pub(crate) struct KeyframeGraph {
    pub(crate) keyframes: Vec<KeyframeNode>,
    pub(crate) frames: Vec<FrameNode>,
    last_motion: Option<KeyframeMotion>,
    next_index: usize,
}

impl KeyframeGraph {
    /// A new keyframe, with the last frame's motion as its link to the one before; its number.
    pub(crate) fn add_keyframe(&mut self, keep: bool, pose: Pose, image: &FramePyramid) -> usize {
        let index = self.next_index;
        self.next_index += 1;
        if keep {
            let parent = self.last_motion.take();
            if let (Some(_), Some(frame)) = (&parent, self.frames.last_mut()) {
                // The frame that became the keyframe hangs on itself from now on.
                frame.keyframe = index;
                frame.keyframe_from_camera = Pose::identity();
            }
            self.keyframes.push(KeyframeNode {
                pose,
                image: image.coarse(),
                parent,
            });
        }
        index
    }

    /// Keyframes made so far, kept or not.
    pub(crate) fn keyframe_count(&self) -> usize {
        self.next_index
    }

    /// The keyframe's image once its rolling shutter is undone.
    pub(crate) fn replace_image(&mut self, index: usize, image: &FramePyramid) {
        if let Some(node) = self.keyframes.get_mut(index) {
            node.image = image.coarse();
        }
    }

    /// Keeps where a frame hangs.
    pub(crate) fn note(&mut self, result: &OdometryResult) {
        let newest = self.next_index.saturating_sub(1);
        let (keyframe, keyframe_from_camera) = match (&result.status, &result.keyframe_motion) {
            (_, Some(motion)) => (motion.keyframe, motion.keyframe_from_camera),
            (TrackStatus::Started, None) => (newest, Pose::identity()),
            (TrackStatus::Skipped(Reason::DuplicateFrame), None) => match self.frames.last() {
                Some(last) => (last.keyframe, last.keyframe_from_camera),
                None => return,
            },
            _ => return,
        };
        if result.keyframe_motion.is_some() {
            self.last_motion = result.keyframe_motion;
        }
        self.frames.push(FrameNode {
            stamp: result.stamp,
            keyframe,
            keyframe_from_camera,
            measured: result.world_from_camera,
        });
    }

    /// Forgets the link to the keyframe before, where the chain of measurements broke.
    pub(crate) fn unlink(&mut self) {
        self.last_motion = None;
    }
}
