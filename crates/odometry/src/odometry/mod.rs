//! Odometry: every frame aligned to a keyframe, with a status for every frame.

mod emission;
mod gyro;
mod measure;
mod promote;
mod result;
mod settings;

use crate::Result;
use crate::keyframe::{Keyframe, LastFrame};
use emission::{Emission, Place};
pub use gyro::Gyro;
use measure::Measured;
pub use result::{OdometryResult, Timings};
pub use settings::OdometryConfig;
use sphereflow_alignment::{
    Aligner, DepthImage, FramePyramid, REFERENCE_WIDTH, VelocityEstimate, pose_from_twist,
    twist_from_pose,
};
use sphereflow_core::{Pose, Reason, Stamp, TrackStatus, Twist};
use sphereflow_sphere::Camera;
use std::time::Instant;

/// Poses of a moving depth camera, one frame at a time.
#[derive(Clone, Debug)]
pub struct DepthOdometry {
    config: OdometryConfig,
    aligner: Aligner,
    max_flow_px: f64,
    keyframe: Option<Keyframe>,
    last: LastFrame,
    current: FramePyramid,
    /// Working memory for the next keyframe.
    spare: FramePyramid,
    /// Last stamp that was accepted.
    last_stamp: Option<Stamp>,
    last_pose: Pose,
    segment: u32,
    /// That of the frame being measured.
    gyro: Option<Gyro>,
    emission: Emission,
}

impl DepthOdometry {
    /// Odometry of `camera`.
    ///
    /// # Errors
    /// Where a setting is out of range or the image is smaller than a block.
    pub fn new(camera: &Camera, config: OdometryConfig) -> Result<Self> {
        config.validate()?;
        Ok(Self {
            aligner: Aligner::new(camera, config.alignment)?,
            max_flow_px: config.keyframes.max_flow_px * camera.width() as f64
                / REFERENCE_WIDTH as f64,
            config,
            keyframe: None,
            last: LastFrame::default(),
            current: FramePyramid::default(),
            spare: FramePyramid::default(),
            last_stamp: None,
            last_pose: Pose::identity(),
            segment: 0,
            gyro: None,
            emission: Emission::default(),
        })
    }

    /// The settings.
    pub fn config(&self) -> &OdometryConfig {
        &self.config
    }

    /// Keyframes so far.
    pub fn keyframe_count(&self) -> usize {
        self.emission.count()
    }

    /// Where the first frame is; has no meaning after it.
    pub fn begin_at(&mut self, world_from_first: Pose) {
        if self.keyframe.is_none() {
            self.last_pose = world_from_first;
        }
    }

    /// The keyframe in use is at another place than was believed: the poses to come go on from there.
    /// Returns the correction, `new_world_from_old_world`; the identity before the first keyframe.
    pub fn rebase(&mut self, world_from_keyframe: &Pose) -> Pose {
        let mut moved = Pose::identity();
        if let Some(keyframe) = &mut self.keyframe {
            let correction = *world_from_keyframe * keyframe.pose.inverse();
            keyframe.pose = *world_from_keyframe;
            self.last.pose = correction * self.last.pose;
            self.last_pose = correction * self.last_pose;
            moved = correction;
        }
        moved
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
        self.push_with_gyro(depth, stamp, None)
    }

    /// The same with the mean angular rate since the last measured frame (bias removed, in the
    /// camera's frame) and its standard deviation, from a gyroscope.
    ///
    /// # Errors
    /// As [`DepthOdometry::push`], and where rate or deviation are not finite or the latter is
    /// negative.
    pub fn push_with_gyro<'a>(
        &mut self,
        depth: impl Into<DepthImage<'a>>,
        stamp: Stamp,
        gyro: Option<Gyro>,
    ) -> Result<OdometryResult> {
        if let Some(gyro) = &gyro {
            gyro.check()?;
        }
        self.gyro = gyro;
        let begin = Instant::now();
        self.aligner
            .average(&depth.into(), "depth", &mut self.current)?;
        let averaging_s = begin.elapsed().as_secs_f64();
        let mut result = self.advance(stamp);
        result.timings = Timings {
            averaging_s,
            estimation_s: begin.elapsed().as_secs_f64() - averaging_s,
        };
        self.emission.measured(result.keyframe_motion);
        result.keyframes = self.emission.take();
        Ok(result)
    }

    /// The next frame has no depth image: its pose is predicted and the frame is lost.
    pub fn push_without_depth(&mut self, stamp: Stamp) -> OdometryResult {
        if let Some(skipped) = self.skip_out_of_order(stamp) {
            return skipped;
        }
        self.last_stamp = Some(stamp);
        self.hold(stamp, Reason::NoDepth, None)
    }

    fn advance(&mut self, stamp: Stamp) -> OdometryResult {
        if let Some(skipped) = self.skip_out_of_order(stamp) {
            return skipped;
        }
        self.last_stamp = Some(stamp);
        let share = self.current.known_share();
        if share < self.config.alignment.min_known_share {
            // The keyframe stays: a short loss of sight is bridged by the next good frame.
            return self.hold(stamp, Reason::FewKnownPixels { share }, None);
        }
        if self.keyframe.is_none() {
            self.start(stamp);
            return self.result(stamp, TrackStatus::Started, None);
        }
        if self.current.same_as(&self.last.image) {
            self.last_pose = self.last.pose;
            let status = TrackStatus::Skipped(Reason::DuplicateFrame);
            return self.result(stamp, status, None);
        }
        let dt_s = stamp.seconds_since(self.last.stamp);
        if dt_s > self.config.alignment.max_gap_s {
            self.segment += 1;
            self.start(stamp);
            let status = TrackStatus::Lost(Reason::Gap { seconds: dt_s });
            return self.result(stamp, status, None);
        }
        match self.measure(dt_s) {
            Ok(measured) => self.accept(stamp, dt_s, measured),
            Err(estimate) => match estimate.status {
                TrackStatus::Lost(reason) => self.hold(stamp, reason, Some(*estimate)),
                _ => self.hold(stamp, Reason::NotConverged, Some(*estimate)),
            },
        }
    }

    /// The current frame becomes the keyframe, where the camera is believed to be.
    fn start(&mut self, stamp: Stamp) {
        self.emission.unlink();
        self.last = LastFrame {
            stamp,
            pose: self.last_pose,
            image: std::mem::take(&mut self.current),
            twist: Twist::default(),
            is_keyframe: true,
            divided: false,
        };
        let image = self.last.image.clone();
        self.set_keyframe(image, self.last_pose, self.config.readout_s == 0.0);
    }

    /// The last frame becomes the keyframe, with the image given.
    fn set_keyframe(&mut self, image: FramePyramid, pose: Pose, shutter_undone: bool) {
        let stamp = self.last.stamp;
        let told = self.config.keyframes.enabled && self.config.emit_keyframes;
        let place = Place {
            stamp,
            segment: self.segment,
            pose,
        };
        let index = self.emission.made(place, told.then_some(&image));
        let old = self.keyframe.replace(Keyframe {
            index,
            stamp,
            pose,
            image,
            shutter_undone,
        });
        self.spare = old.map(|keyframe| keyframe.image).unwrap_or_default();
    }

    fn accept(&mut self, stamp: Stamp, dt_s: f64, measured: Measured) -> OdometryResult {
        let step = self.last.pose.inverse() * measured.pose;
        std::mem::swap(&mut self.last.image, &mut self.current);
        self.last.stamp = stamp;
        self.last.pose = measured.pose;
        self.last.twist = twist_from_pose(&step, dt_s);
        self.last.is_keyframe = false;
        self.last.divided = matches!(
            measured.estimate.status,
            TrackStatus::Weak(Reason::Divided { .. })
        );
        self.last_pose = measured.pose;
        self.result(stamp, measured.estimate.status, Some(measured))
    }

    fn skip_out_of_order(&self, stamp: Stamp) -> Option<OdometryResult> {
        let late = self.last_stamp.is_some_and(|last| stamp <= last);
        let status = TrackStatus::Skipped(Reason::StampNotIncreasing);
        late.then(|| self.result(stamp, status, None))
    }

    /// A frame that cannot be measured: constant velocity since the last measured one, for as long
    /// as a gap may be; after that the camera is left where it was.
    fn hold(
        &mut self,
        stamp: Stamp,
        reason: Reason,
        estimate: Option<VelocityEstimate>,
    ) -> OdometryResult {
        if self.keyframe.is_some() {
            let dt_s = stamp.seconds_since(self.last.stamp);
            if dt_s <= self.config.alignment.max_gap_s {
                self.last_pose = self.last.pose * pose_from_twist(&self.last.twist, dt_s);
            }
        }
        let mut result = self.result(stamp, TrackStatus::Lost(reason), None);
        result.estimate = estimate;
        result
    }

    fn result(
        &self,
        stamp: Stamp,
        status: TrackStatus,
        measured: Option<Measured>,
    ) -> OdometryResult {
        let (keyframe_motion, estimate) = measured
            .map(|measured| (measured.keyframe_motion, measured.estimate))
            .unzip();
        OdometryResult {
            stamp,
            status,
            world_from_camera: self.last_pose,
            twist: estimate.as_ref().and_then(|e| e.twist),
            covariance: estimate.as_ref().and_then(|e| e.covariance),
            keyframe_motion,
            estimate,
            segment: self.segment,
            keyframes: Vec::new(),
            timings: Timings::default(),
        }
    }
}
