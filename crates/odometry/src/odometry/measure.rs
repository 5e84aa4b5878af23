//! The pose of a frame against the keyframe: predicted, aligned, judged, and tried again.

use super::DepthOdometry;
use crate::keyframe::KeyframeMotion;
use nalgebra::Matrix6;
use sphereflow_alignment::{
    Alignment, MotionPrior, Priors, ReadOut, VelocityEstimate, pose_from_twist,
};
use sphereflow_core::{Pose, Reason, TrackStatus, Twist};

/// A frame that was measured.
pub(super) struct Measured {
    pub(super) alignment: Alignment,
    pub(super) pose: Pose,
    pub(super) keyframe_motion: KeyframeMotion,
    pub(super) estimate: VelocityEstimate,
}

/// A measured frame, or what was wrong.
type Outcome = std::result::Result<Measured, Box<VelocityEstimate>>;

impl DepthOdometry {
    /// The pose of the current frame, against the keyframe, or against the frame before where the
    /// keyframe has gone out of sight; otherwise what was wrong.
    pub(super) fn measure(&mut self, dt_s: f64) -> Outcome {
        let mut twist = self.last.twist;
        if let Some(gyro) = &self.gyro {
            twist.angular_rad_s = gyro.rate_rad_s;
        }
        let predicted = self.last.pose * pose_from_twist(&twist, dt_s);
        // Where nothing predicts the motion, something that moves on its own may look as right.
        let unknown = self.last.twist == Twist::default() || self.last.divided;
        let mut found = self.align(dt_s, predicted, unknown);
        if let (Ok(measured), Some(false)) =
            (&found, self.keyframe.as_ref().map(|k| k.shutter_undone))
        {
            // Only now is it known how the camera moved while the keyframe was read out.
            let (twist, pose) = (measured.estimate.twist.unwrap_or_default(), measured.pose);
            self.undo_keyframe(twist);
            found = self.align(dt_s, pose, false);
        }
        let renew = match &found {
            Ok(measured) => {
                !self.config.keyframes.enabled
                    || measured.alignment.overlap < self.config.keyframes.min_overlap
                    || measured.alignment.flow_px > self.max_flow_px
            }
            Err(_) => true,
        };
        if !renew || self.last.is_keyframe {
            if found.is_err() {
                return self.retry(dt_s, predicted, found);
            }
            return found;
        }
        let guess = found.as_ref().map_or(predicted, |measured| measured.pose);
        self.promote_last(dt_s, found.as_ref().ok().map(|measured| measured.pose));
        let again = self.align(dt_s, guess, false);
        if again.is_err() {
            return self.retry(dt_s, predicted, again);
        }
        again
    }

    /// Other first guesses: as predicted but with samples, and a camera that stands still.
    fn retry(&mut self, dt_s: f64, predicted: Pose, failed: Outcome) -> Outcome {
        for guess in [predicted, self.last.pose] {
            if let Ok(measured) = self.align(dt_s, guess, true) {
                return Ok(measured);
            }
        }
        failed
    }

    /// Aligns the current frame to the keyframe and judges the result.
    fn align(&mut self, dt_s: f64, guess: Pose, restart: bool) -> Outcome {
        let config = &self.config.alignment;
        let Some(keyframe) = &self.keyframe else {
            let lost = VelocityEstimate::lost(Reason::NotConverged, 0.0);
            return Err(Box::new(lost));
        };
        let keyframe_from_world = keyframe.pose.inverse();
        let keyframe_from_earlier = keyframe_from_world * self.last.pose;
        let readout = (self.config.readout_s != 0.0).then_some(ReadOut {
            readout_s: self.config.readout_s,
            keyframe_from_earlier,
            since_s: dt_s,
        });
        let priors = Priors {
            motion: self.rotation_prior(dt_s, &keyframe_from_earlier),
            readout,
            restart,
            ..Priors::default()
        };
        let alignment = self.aligner.align(
            &keyframe.image,
            &self.current,
            keyframe_from_world * guess,
            &priors,
        );
        let step = keyframe_from_earlier.inverse() * alignment.motion;
        let mut estimate = VelocityEstimate::of_alignment(config, &alignment, &step, dt_s);
        let Some(covariance) = alignment.covariance else {
            return Err(Box::new(estimate));
        };
        let pose = keyframe.pose * alignment.motion;
        let policy = &self.config.keyframes;
        let surprise = (pose.translation - guess.translation).norm();
        if estimate.status.has_pose()
            && (alignment.overlap < policy.least_overlap || surprise > policy.max_surprise_m)
        {
            estimate.status = TrackStatus::Lost(Reason::PoorFit {
                scale: alignment.residual_scale,
            });
        }
        if self.last.divided
            && estimate.status == TrackStatus::Tracked
            && estimate.divided_share > STILL_DIVIDED * config.max_divided_share
        {
            estimate.status = TrackStatus::Weak(Reason::Divided {
                share: estimate.divided_share,
            });
        }
        if !estimate.status.has_pose() {
            return Err(Box::new(estimate));
        }
        let keyframe_motion = KeyframeMotion {
            keyframe: keyframe.index,
            keyframe_from_camera: alignment.motion,
            covariance,
        };
        Ok(Measured {
            alignment,
            pose,
            keyframe_motion,
            estimate,
        })
    }

    /// The motion that the gyroscope predicts, with the information in the keyframe's frame: a
    /// rotation about the camera is one about the keyframe, by the same angle.
    fn rotation_prior(&self, dt_s: f64, keyframe_from_last: &Pose) -> Option<MotionPrior> {
        let gyro = self.gyro?;
        let twist = Twist {
            angular_rad_s: gyro.rate_rad_s,
            linear_m_s: self.last.twist.linear_m_s,
        };
        let angle = gyro.least_std_rad_s() * dt_s;
        let mut information = Matrix6::zeros();
        for k in 0..3 {
            information[(k, k)] = 1.0 / (angle * angle);
        }
        Some(MotionPrior {
            keyframe_from_frame: *keyframe_from_last * pose_from_twist(&twist, dt_s),
            information,
        })
    }
}

/// A scene that was divided stays so until fewer domains, by this factor, follow another motion.
const STILL_DIVIDED: f64 = 0.5;
