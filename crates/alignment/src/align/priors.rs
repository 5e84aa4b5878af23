//! What is known of a motion before two frames are aligned.

use crate::brightness::BrightnessPyramid;
use crate::robust::Prior;
use nalgebra::Matrix6;
use sphereflow_core::Pose;
use sphereflow_sphere::lie::se3;

/// A motion known from elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionPrior {
    /// `keyframe_from_frame`.
    pub keyframe_from_frame: Pose,
    /// Inverse of its covariance, `[rotation, translation]` (radians, metres) in the keyframe's
    /// frame: of the `xi` in `exp(xi) * keyframe_from_frame`. Zero rows for what is not known.
    pub information: Matrix6<f64>,
}

impl MotionPrior {
    /// What is known of the step that is left to do from `motion`.
    pub(super) fn of_step(&self, motion: &Pose) -> Prior {
        let left = se3::log(&(self.keyframe_from_frame * motion.inverse()));
        Prior {
            motion: left,
            information: self.information,
            gradient: self.information * left,
        }
    }
}

/// How the frame was read out, as far as known before its motion is. The keyframe counts as exposed
/// at once: see [`crate::Aligner::undo_rolling_shutter`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReadOut {
    /// Time between the exposures of first and last row, seconds; negative: the last comes first.
    pub readout_s: f64,
    /// Pose of an earlier frame in the keyframe's frame, and the time since then, seconds: with the
    /// pose sought it makes the velocity during the exposure.
    pub keyframe_from_earlier: Pose,
    /// Seconds from the earlier frame's stamp to the frame's; positive.
    pub since_s: f64,
}

/// What is known beside the two frames and the first guess. The default is nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Priors<'a> {
    /// The motion, from another sensor. Directions that the images do not determine take its value.
    pub motion: Option<MotionPrior>,
    /// `None`: all rows were exposed at the stamp.
    pub readout: Option<ReadOut>,
    /// Brightness of the keyframe and of the frame, whose pixels see what those of the depth images
    /// do.
    pub brightness: Option<(&'a BrightnessPyramid, &'a BrightnessPyramid)>,
    /// The finest level used, 0 the finest of all: each higher one has a quarter of the blocks.
    /// Levels that one of the frames lacks are left out in any case.
    pub finest_level: usize,
    /// True where nothing predicts the motion: where the first solve leaves more than noise, small
    /// samples of the domains and further levels are tried too.
    pub restart: bool,
}
