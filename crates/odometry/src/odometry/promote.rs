//! How a frame becomes a keyframe: as if all its rows had been exposed at the stamp.

use super::DepthOdometry;
use super::emission::Place;
use sphereflow_alignment::FramePyramid;
use sphereflow_alignment::twist_from_pose;
use sphereflow_core::{Pose, Twist};
use sphereflow_sphere::RollingShutter;

impl DepthOdometry {
    /// The last frame becomes the keyframe. `next` is where the current frame is believed to be:
    /// with it, the velocity during the exposure is the mean of before and after.
    pub(super) fn promote_last(&mut self, dt_s: f64, next: Option<Pose>) {
        let mut twist = self.last.twist;
        if let Some(next) = next {
            let after = twist_from_pose(&(self.last.pose.inverse() * next), dt_s);
            twist = Twist::from_vector(&((twist.vector() + after.vector()) / 2.0));
        }
        let image = self.shutter_undone(twist);
        self.set_keyframe(image, self.last.pose, true);
        self.last.is_keyframe = true;
    }

    /// The first keyframe as it would be without rolling shutter.
    pub(super) fn undo_keyframe(&mut self, twist: Twist) {
        let image = self.shutter_undone(twist);
        if let Some(keyframe) = &mut self.keyframe {
            if self.config.keyframes.enabled && self.config.emit_keyframes {
                let place = Place {
                    stamp: keyframe.stamp,
                    segment: self.segment,
                    pose: keyframe.pose,
                };
                self.emission.improved(keyframe.index, place, &image);
            }
            keyframe.image = image;
            keyframe.shutter_undone = true;
        }
    }

    /// The last frame without rolling shutter.
    fn shutter_undone(&mut self, twist: Twist) -> FramePyramid {
        let mut image = std::mem::take(&mut self.spare);
        let shutter = RollingShutter {
            twist,
            readout_s: self.config.readout_s,
        };
        if shutter.is_global() {
            image.clone_from(&self.last.image);
        } else {
            self.aligner
                .undo_rolling_shutter(&self.last.image, shutter, &mut image);
        }
        image
    }
}
