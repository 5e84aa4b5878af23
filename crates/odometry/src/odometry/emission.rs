//! The keyframes that the odometry tells of: it keeps only the one in use.

use crate::keyframe::{KeyframeEvent, KeyframeMotion};
use sphereflow_alignment::FramePyramid;
use sphereflow_core::{Pose, Stamp};

/// Numbers the keyframes, and holds those that the next result tells of.
#[derive(Clone, Debug, Default)]
pub(super) struct Emission {
    next_index: usize,
    /// How the last measured frame hung on its keyframe: the link of a keyframe made of it.
    last_motion: Option<KeyframeMotion>,
    events: Vec<KeyframeEvent>,
}

impl Emission {
    /// Keyframes made so far.
    pub(super) fn count(&self) -> usize {
        self.next_index
    }

    /// A new keyframe; its number.
    pub(super) fn made(&mut self, place: Place, image: Option<&FramePyramid>) -> usize {
        let index = self.next_index;
        self.next_index += 1;
        if let Some(image) = image {
            self.events.push(KeyframeEvent {
                index,
                stamp: place.stamp,
                segment: place.segment,
                world_from_keyframe: place.pose,
                image: image.coarse(),
                parent: self.last_motion.take(),
            });
        }
        index
    }

    /// A keyframe's image once its rolling shutter is undone.
    pub(super) fn improved(&mut self, index: usize, place: Place, image: &FramePyramid) {
        self.events.push(KeyframeEvent {
            index,
            stamp: place.stamp,
            segment: place.segment,
            world_from_keyframe: place.pose,
            image: image.coarse(),
            parent: None,
        });
    }

    /// How the newest frame was measured.
    pub(super) fn measured(&mut self, motion: Option<KeyframeMotion>) {
        self.last_motion = motion.or(self.last_motion.take());
    }

    /// The chain of measurements broke: the next keyframe has no parent.
    pub(super) fn unlink(&mut self) {
        self.last_motion = None;
    }

    /// What has not been told yet.
    pub(super) fn take(&mut self) -> Vec<KeyframeEvent> {
        std::mem::take(&mut self.events)
    }
}

/// When and where a keyframe was made.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) stamp: Stamp,
    pub(super) segment: u32,
    pub(super) pose: Pose,
}
