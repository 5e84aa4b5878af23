//! Frame-to-frame odometry: velocities chained into poses, with a status for every frame.

use crate::Result;
use crate::binning::InverseDepth;
use crate::config::Config;
use crate::depth_image::DepthImage;
use crate::estimate::{VelocityEstimate, VelocityEstimator};
use crate::motion::pose_from_twist;
use nalgebra::Matrix6;
use sphereflow_core::{Pose, Reason, Stamp, TrackStatus, Twist};
use sphereflow_sphere::Camera;
use std::time::Instant;

/// Seconds spent on one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Timings {
    /// Checks and block averages.
    pub averaging_s: f64,
    /// Weak form and robust solve.
    pub estimation_s: f64,
}

/// What became of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct OdometryResult {
    /// The frame's stamp.
    pub stamp: Stamp,
    /// Measured or not, and why. Only where [`TrackStatus::has_pose`] is the pose measured.
    pub status: TrackStatus,
    /// Pose of the camera; the world is the camera frame of the first frame. Where the frame was
    /// lost it is predicted with constant velocity, where skipped it is that of the frame before.
    pub world_from_camera: Pose,
    /// Measured velocity since the frame before, camera's own frame; `None` where not measured.
    pub twist: Option<Twist>,
    /// Covariance of the twist, order `[omega, v]`; `None` where not measured.
    pub covariance: Option<Matrix6<f64>>,
    /// The whole measurement; `None` for the first frame and frames that were not compared.
    pub estimate: Option<VelocityEstimate>,
    /// Grows by one whenever the chain of measurements breaks: poses of different segments hang
    /// together by prediction only.
    pub segment: u32,
    /// Where the time went.
    pub timings: Timings,
}

/// The frame that the next one is measured against.
#[derive(Clone, Debug)]
struct Reference {
    stamp: Stamp,
    pose: Pose,
}

/// Poses of a moving depth camera, one frame at a time.
#[derive(Clone, Debug)]
pub struct DepthOdometry {
    estimator: VelocityEstimator,
    reference: Option<Reference>,
    reference_depth: InverseDepth,
    current_depth: InverseDepth,
    /// Last stamp that was accepted.
    last_stamp: Option<Stamp>,
    last_pose: Pose,
    /// Last measured velocity; zero before the first.
    twist: Twist,
    segment: u32,
}

impl DepthOdometry {
    /// Odometry of `camera`.
    ///
    /// # Errors
    /// Where a setting is out of range or the image is smaller than a block.
    pub fn new(camera: &Camera, config: Config) -> Result<Self> {
        Ok(Self {
            estimator: VelocityEstimator::new(camera, config)?,
            reference: None,
            reference_depth: InverseDepth::default(),
            current_depth: InverseDepth::default(),
            last_stamp: None,
            last_pose: Pose::identity(),
            twist: Twist::default(),
            segment: 0,
        })
    }

    /// The settings.
    pub fn config(&self) -> &Config {
        self.estimator.config()
    }

    /// The next frame.
    ///
    /// # Errors
    /// A core shape error where the image is not of the camera's size; the odometry is as before.
    pub fn push<'a>(
        &mut self,
        depth: impl Into<DepthImage<'a>>,
        stamp: Stamp,
    ) -> Result<OdometryResult> {
        let begin = Instant::now();
        let mut current = std::mem::take(&mut self.current_depth);
        let averaged = self.estimator.average(&depth.into(), "depth", &mut current);
        self.current_depth = current;
        averaged?;
        let averaging_s = begin.elapsed().as_secs_f64();
        let mut result = self.advance(stamp);
        result.timings = Timings {
            averaging_s,
            estimation_s: begin.elapsed().as_secs_f64() - averaging_s,
        };
        Ok(result)
    }

    /// The next frame has no depth image: its pose is predicted and the frame is lost.
    pub fn push_without_depth(&mut self, stamp: Stamp) -> OdometryResult {
        if let Some(skipped) = self.skip_out_of_order(stamp) {
            return skipped;
        }
        self.last_stamp = Some(stamp);
        self.hold(stamp, Reason::NoDepth)
    }

    fn advance(&mut self, stamp: Stamp) -> OdometryResult {
        if let Some(skipped) = self.skip_out_of_order(stamp) {
            return skipped;
        }
        self.last_stamp = Some(stamp);
        let share = self.current_depth.known_share();
        if share < self.config().min_known_share {
            // The reference stays: a short loss of sight is bridged by the next good frame.
            return self.hold(stamp, Reason::FewKnownPixels { share });
        }
        let Some(reference) = self.reference.clone() else {
            self.set_reference(stamp, self.last_pose);
            return self.result(stamp, TrackStatus::Started, None);
        };
        if self.current_depth.same_as(&self.reference_depth) {
            self.last_pose = reference.pose;
            return self.result(stamp, TrackStatus::Skipped(Reason::DuplicateFrame), None);
        }
        let dt_s = stamp.seconds_since(reference.stamp);
        if dt_s > self.config().max_gap_s {
            self.segment += 1;
            self.twist = Twist::default();
            self.set_reference(stamp, self.last_pose);
            let status = TrackStatus::Lost(Reason::Gap { seconds: dt_s });
            return self.result(stamp, status, None);
        }
        self.measure(stamp, &reference, dt_s)
    }

    fn measure(&mut self, stamp: Stamp, reference: &Reference, dt_s: f64) -> OdometryResult {
        let estimate = self.estimator.solve(
            &self.reference_depth,
            &self.current_depth,
            dt_s,
            &self.twist,
        );
        let measured = estimate.twist;
        let twist = measured.unwrap_or(self.twist);
        let pose = reference.pose * pose_from_twist(&twist, dt_s);
        if measured.is_none() {
            self.segment += 1;
        }
        self.twist = twist;
        self.last_pose = pose;
        self.set_reference(stamp, pose);
        self.result(stamp, estimate.status, Some(estimate))
    }

    fn skip_out_of_order(&self, stamp: Stamp) -> Option<OdometryResult> {
        let late = self.last_stamp.is_some_and(|last| stamp <= last);
        let status = TrackStatus::Skipped(Reason::StampNotIncreasing);
        late.then(|| self.result(stamp, status, None))
    }

    /// A frame that cannot be measured: constant velocity since the reference, for as long as a
    /// gap may be; after that the camera is left where it was.
    fn hold(&mut self, stamp: Stamp, reason: Reason) -> OdometryResult {
        if let Some(reference) = &self.reference {
            let dt_s = stamp.seconds_since(reference.stamp);
            if dt_s <= self.config().max_gap_s {
                self.last_pose = reference.pose * pose_from_twist(&self.twist, dt_s);
            }
        }
        self.result(stamp, TrackStatus::Lost(reason), None)
    }

    fn set_reference(&mut self, stamp: Stamp, pose: Pose) {
        std::mem::swap(&mut self.reference_depth, &mut self.current_depth);
        self.reference = Some(Reference { stamp, pose });
    }

    fn result(
        &self,
        stamp: Stamp,
        status: TrackStatus,
        estimate: Option<VelocityEstimate>,
    ) -> OdometryResult {
        OdometryResult {
            stamp,
            status,
            world_from_camera: self.last_pose,
            twist: estimate.as_ref().and_then(|e| e.twist),
            covariance: estimate.as_ref().and_then(|e| e.covariance),
            estimate,
            segment: self.segment,
            timings: Timings::default(),
        }
    }
}
