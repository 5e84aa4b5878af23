//! Odometry: every frame aligned to a keyframe, with a status for every frame.

use crate::Result;
use crate::align::{Aligner, Alignment, ReadOut, Task};
use crate::config::Config;
use crate::depth_image::DepthImage;
use crate::estimate::{VelocityEstimate, VelocityPrior, judge_motion, keyframe_covariance};
use crate::graph::{GraphConfig, KeyframeGraph};
use crate::keyframe::{Keyframe, KeyframeMotion, KeyframePolicy, LastFrame};
use crate::motion::{pose_from_twist, twist_from_pose};
use crate::pyramid::FramePyramid;
use crate::row_motion::RollingShutter;
use nalgebra::{Matrix6, Vector3};
use sphereflow_core::{Error, Pose, Reason, Stamp, TrackStatus, Twist};
use sphereflow_sphere::Camera;
use std::time::Instant;

/// Settings of [`DepthOdometry`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OdometryConfig {
    /// How two images are aligned.
    pub alignment: Config,
    /// When keyframes are made.
    pub keyframes: KeyframePolicy,
    /// Rolling shutter: time between the exposures of the first and the last row, seconds; the
    /// stamp is that of the middle row. 0: all rows at once. Negative: the last row comes first.
    pub readout_s: f64,
    /// Which pairs of keyframes [`DepthOdometry::optimise`] compares.
    pub graph: GraphConfig,
}

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
    /// Measured velocity since the last measured frame, camera's own frame; `None` where not
    /// measured.
    pub twist: Option<Twist>,
    /// Covariance of the twist, order `[omega, v]`; `None` where not measured.
    pub covariance: Option<Matrix6<f64>>,
    /// Pose relative to the keyframe that it was measured against, with its covariance.
    pub keyframe_motion: Option<KeyframeMotion>,
    /// The measurement; `None` for the first frame and frames that were not compared.
    pub estimate: Option<VelocityEstimate>,
    /// Grows by one whenever the chain of measurements breaks: poses of different segments hang
    /// together by prediction only.
    pub segment: u32,
    /// Where the time went.
    pub timings: Timings,
}

/// Poses of a moving depth camera, one frame at a time.
#[derive(Clone, Debug)]
pub struct DepthOdometry {
    pub(crate) config: OdometryConfig,
    pub(crate) aligner: Aligner,
    max_flow_px: f64,
    pub(crate) keyframe: Option<Keyframe>,
    pub(crate) last: LastFrame,
    current: FramePyramid,
    /// Working memory for the next keyframe.
    spare: FramePyramid,
    /// Last stamp that was accepted.
    last_stamp: Option<Stamp>,
    pub(crate) last_pose: Pose,
    segment: u32,
    /// That of the frame being measured.
    gyro: Option<Gyro>,
    pub(crate) graph: KeyframeGraph,
}

/// A gyroscope's mean rate between two frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gyro {
    /// Bias removed, in the camera's frame.
    pub rate_rad_s: Vector3<f64>,
    /// Standard deviation of each component; 0 holds the rotation fixed.
    pub std_rad_s: f64,
}

impl Gyro {
    fn check(&self) -> Result<()> {
        let finite = self.rate_rad_s.iter().all(|v| v.is_finite());
        if finite && self.std_rad_s.is_finite() && self.std_rad_s >= 0.0 {
            return Ok(());
        }
        let expected = "finite rates with a standard deviation that is not negative";
        Err(Error::value("gyro", expected, format!("{self:?}")).into())
    }

    /// As a prior for [`crate::VelocityEstimator`].
    pub fn prior(&self) -> VelocityPrior {
        VelocityPrior::of_gyro(self.rate_rad_s, self.std_rad_s.max(LEAST_GYRO_STD))
    }
}

/// A frame that was measured.
struct Measured {
    alignment: Alignment,
    pose: Pose,
    keyframe_motion: KeyframeMotion,
    estimate: VelocityEstimate,
}

impl DepthOdometry {
    /// Odometry of `camera`.
    ///
    /// # Errors
    /// Where a setting is out of range or the image is smaller than a block.
    pub fn new(camera: &Camera, config: OdometryConfig) -> Result<Self> {
        if !(config.readout_s.is_finite() && config.readout_s.abs() <= MAX_READOUT_S) {
            let expected = format!("at most {MAX_READOUT_S} s between first and last row");
            return Err(Error::value("readout_s", expected, config.readout_s).into());
        }
        Ok(Self {
            aligner: Aligner::new(camera, &config.alignment)?,
            max_flow_px: config.keyframes.max_flow_px * camera.width() as f64
                / crate::config::REFERENCE_WIDTH as f64,
            config,
            keyframe: None,
            last: LastFrame::default(),
            current: FramePyramid::default(),
            spare: FramePyramid::default(),
            last_stamp: None,
            last_pose: Pose::identity(),
            segment: 0,
            gyro: None,
            graph: KeyframeGraph::default(),
        })
    }

    /// The settings.
    pub fn config(&self) -> &OdometryConfig {
        &self.config
    }

    /// Keyframes so far.
    pub fn keyframe_count(&self) -> usize {
        self.graph.keyframe_count()
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
        let stack = &self.aligner.stack;
        stack.average(&depth.into(), "depth", &mut self.current)?;
        let averaging_s = begin.elapsed().as_secs_f64();
        let mut result = self.advance(stamp);
        result.timings = Timings {
            averaging_s,
            estimation_s: begin.elapsed().as_secs_f64() - averaging_s,
        };
        self.graph.note(&result);
        Ok(result)
    }

    /// The next frame has no depth image: its pose is predicted and the frame is lost.
    pub fn push_without_depth(&mut self, stamp: Stamp) -> OdometryResult {
        if let Some(skipped) = self.skip_out_of_order(stamp) {
            return skipped;
        }
        self.last_stamp = Some(stamp);
        let result = self.hold(stamp, Reason::NoDepth, None);
        self.graph.note(&result);
        result
    }

    fn advance(&mut self, stamp: Stamp) -> OdometryResult {
        if let Some(skipped) = self.skip_out_of_order(stamp) {
            return skipped;
        }
        self.last_stamp = Some(stamp);
        let share = self.current.levels[0].known_share();
        if share < self.config.alignment.min_known_share {
            // The keyframe stays: a short loss of sight is bridged by the next good frame.
            return self.hold(stamp, Reason::FewKnownPixels { share }, None);
        }
        if self.keyframe.is_none() {
            self.start(stamp);
            return self.result(stamp, TrackStatus::Started, None);
        }
        if self.current.levels[0].same_as(&self.last.image.levels[0]) {
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
        self.graph.unlink();
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

    fn set_keyframe(&mut self, image: FramePyramid, pose: Pose, shutter_undone: bool) {
        let keep = self.config.keyframes.enabled && self.config.graph.enabled;
        let index = self.graph.add_keyframe(keep, pose, &image);
        let old = self.keyframe.replace(Keyframe {
            index,
            pose,
            image,
            shutter_undone,
        });
        self.spare = old.map(|keyframe| keyframe.image).unwrap_or_default();
    }

    /// The pose of the current frame, against the keyframe, or against the frame before where the
    /// keyframe has gone out of sight; otherwise what was wrong.
    fn measure(&mut self, dt_s: f64) -> std::result::Result<Measured, Box<VelocityEstimate>> {
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
    fn retry(
        &mut self,
        dt_s: f64,
        predicted: Pose,
        failed: std::result::Result<Measured, Box<VelocityEstimate>>,
    ) -> std::result::Result<Measured, Box<VelocityEstimate>> {
        for guess in [predicted, self.last.pose] {
            if let Ok(measured) = self.align(dt_s, guess, true) {
                return Ok(measured);
            }
        }
        failed
    }

    /// Aligns the current frame to the keyframe and judges the result.
    fn align(
        &mut self,
        dt_s: f64,
        guess: Pose,
        restart: bool,
    ) -> std::result::Result<Measured, Box<VelocityEstimate>> {
        let config = &self.config.alignment;
        let Some(keyframe) = &self.keyframe else {
            let lost = VelocityEstimate::lost(Reason::NotConverged, 0.0);
            return Err(Box::new(lost));
        };
        let keyframe_from_world = keyframe.pose.inverse();
        let first_from_earlier = keyframe_from_world * self.last.pose;
        let readout = (self.config.readout_s != 0.0).then_some(ReadOut {
            readout_s: self.config.readout_s,
            first_from_earlier,
            since_s: dt_s,
        });
        let task = Task {
            first: &keyframe.image,
            second: &self.current,
            guess: keyframe_from_world * guess,
            prior: self.rotation_prior(dt_s, &first_from_earlier),
            readout,
            brightness: None,
            finest: 0,
            restart,
        };
        let alignment = match self.aligner.align(config, &task) {
            Ok(alignment) => alignment,
            Err((reason, share)) => return Err(Box::new(VelocityEstimate::lost(reason, share))),
        };
        let step = first_from_earlier.inverse() * alignment.motion;
        let mut estimate = judge_motion(config, &alignment, &step, dt_s);
        let pose = keyframe.pose * alignment.motion;
        let policy = &self.config.keyframes;
        let surprise = (pose.translation - guess.translation).norm();
        if estimate.status.has_pose()
            && (alignment.overlap < policy.least_overlap || surprise > policy.max_surprise_m)
        {
            estimate.status = TrackStatus::Lost(Reason::PoorFit {
                scale: alignment.solution.scale,
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
            covariance: keyframe_covariance(config, &alignment),
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
    fn rotation_prior(&self, dt_s: f64, keyframe_from_last: &Pose) -> Option<(Pose, Matrix6<f64>)> {
        let gyro = self.gyro?;
        let twist = Twist {
            angular_rad_s: gyro.rate_rad_s,
            linear_m_s: self.last.twist.linear_m_s,
        };
        let angle = gyro.std_rad_s.max(LEAST_GYRO_STD) * dt_s;
        let mut information = Matrix6::zeros();
        for k in 0..3 {
            information[(k, k)] = 1.0 / (angle * angle);
        }
        Some((
            *keyframe_from_last * pose_from_twist(&twist, dt_s),
            information,
        ))
    }

    /// The last frame becomes the keyframe. `next` is where the current frame is believed to be:
    /// with it, the velocity during the exposure is the mean of before and after.
    fn promote_last(&mut self, dt_s: f64, next: Option<Pose>) {
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
    fn undo_keyframe(&mut self, twist: Twist) {
        let image = self.shutter_undone(twist);
        if let Some(keyframe) = &mut self.keyframe {
            self.graph.replace_image(keyframe.index, &image);
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
            let config = &self.config.alignment;
            self.aligner
                .undo_rolling_shutter(config, &self.last.image, shutter, &mut image);
        }
        image
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
            timings: Timings::default(),
        }
    }
}

/// A rotation held fixed: small beside what images can tell, and far from rounding errors, rad/s.
const LEAST_GYRO_STD: f64 = 1e-5;
/// A scene that was divided stays so until fewer domains, by this factor, follow another motion.
const STILL_DIVIDED: f64 = 0.5;
/// Longer than any camera takes for an image.
const MAX_READOUT_S: f64 = 0.2;
