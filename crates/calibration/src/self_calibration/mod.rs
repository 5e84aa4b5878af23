//! Self-calibration of a depth camera from its motion alone.
//!
//! Two depth images of a still world, taken from different places, agree on one rigid motion only
//! where their rays, their depths and the times of their rows are right. [`SelfCalibrator`] takes
//! the frames of a recording, finds their motion, and then looks for the lens, the
//! [`sphereflow_sphere::DepthCorrection`] and the read-out time with which pairs of frames a
//! fraction of a second apart agree best: Gauss-Newton on the domain means of the weak form, each
//! pair's motion eliminated. No true poses, no target. What the motion does not show stays at the
//! prior and is listed.
//!
//! The unit of length is not among it: a depth camera that measures everything 1 % too long is
//! never contradicted by its own motion.

mod config;
mod frames;
mod image_model;
mod pair_fit;
mod parameters;
mod result;
mod row_warp;
mod search;
mod solve;

pub use config::SelfCalibrationConfig;
pub use result::{CalibratedParameter, CalibrationStatus, HeldCombination, SelfCalibration};

use crate::Result;
use frames::Frame;
use search::Search;
use sphereflow_alignment::binning::{BlockRule, InverseDepth};
use sphereflow_alignment::{Axis, DepthImage};
use sphereflow_alignment::{Config, REFERENCE_WIDTH};
use sphereflow_core::{Error as CoreError, Stamp, TrackStatus};
use sphereflow_odometry::{DepthOdometry, OdometryConfig, OdometryResult};
use sphereflow_sphere::Camera;

/// Collects the frames of a recording and calibrates the camera that took them.
#[derive(Clone, Debug)]
pub struct SelfCalibrator {
    camera: Camera,
    config: SelfCalibrationConfig,
    odometry_config: Config,
    odometry: DepthOdometry,
    frames: Vec<Frame>,
}

impl SelfCalibrator {
    /// For the frames of `camera`, the calibration so far.
    ///
    /// # Errors
    /// Where a setting is out of range, the image is smaller than a block, or the camera sees all
    /// around: its ranges have no correction along an optical axis.
    pub fn new(camera: &Camera, config: SelfCalibrationConfig) -> Result<Self> {
        config.validate()?;
        if camera.wraps_around() {
            let expected = "a camera with an optical axis";
            return Err(CoreError::value("camera", expected, camera.model_name()));
        }
        let odometry_config = Config::default();
        let scaled = config.block as f64 * camera.width() as f64 / REFERENCE_WIDTH as f64;
        let config = SelfCalibrationConfig {
            block: (scaled.round() as usize).clamp(1, 32),
            ..config
        };
        Ok(Self {
            odometry: DepthOdometry::new(
                camera,
                OdometryConfig {
                    readout_s: config.readout_s,
                    ..OdometryConfig::default()
                },
            )?,
            camera: camera.clone(),
            config,
            odometry_config,
            frames: Vec::new(),
        })
    }

    /// The camera, its calibration so far.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The settings, with the block that this camera's image gets.
    pub fn config(&self) -> &SelfCalibrationConfig {
        &self.config
    }

    /// The next frame, as the camera measured it. Its pose comes from [`DepthOdometry`]; frames
    /// without a measured pose and repeated images are left out.
    ///
    /// # Errors
    /// A core shape error where the image is not of the camera's size, a value error for a range
    /// image.
    pub fn push<'a>(
        &mut self,
        depth: impl Into<DepthImage<'a>>,
        stamp: Stamp,
    ) -> Result<OdometryResult> {
        let depth = depth.into();
        if depth.axis() != Axis::Optical {
            let expected = "depth along the optical axis";
            return Err(CoreError::value("depth", expected, "range along the ray"));
        }
        let result = self.odometry.push(depth, stamp)?;
        let skipped = matches!(result.status, TrackStatus::Skipped(_));
        if !result.status.has_pose() || skipped {
            return Ok(result);
        }
        let mut measured = InverseDepth::default();
        let rule = BlockRule {
            block: self.config.block,
            known_share: self.odometry_config.block_known_share as f32,
            max_spread: self.odometry_config.max_jump as f32,
        };
        measured.average(&depth, None, rule);
        self.frames.push(Frame {
            stamp,
            mean_distance_m: mean_distance_m(&measured),
            measured,
            world_from_camera: result.world_from_camera,
            segment: result.segment,
        });
        Ok(result)
    }

    /// Frames with a measured pose so far.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// True before the first.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// Calibrates. `progress` is called with the steps done and the steps at most.
    ///
    /// # Errors
    /// Where a step leads to a camera that cannot be: the priors are too weak for the data.
    pub fn solve(&self, mut progress: impl FnMut(usize, usize)) -> Result<SelfCalibration> {
        let total = self.config.iterations + 2;
        let mut search = Search::new(
            &self.camera,
            &self.config,
            &self.odometry_config,
            &self.frames,
        )?;
        progress(1, total);
        if let Some(status) = search.too_few_pairs() {
            return search.unchanged(status);
        }
        for iteration in 0..self.config.iterations {
            let settled = search.step()?;
            progress(iteration + 2, total);
            if let Some(status) = search.too_few_pairs() {
                return search.unchanged(status);
            }
            if settled {
                break;
            }
        }
        let found = search.finish();
        progress(total, total);
        found
    }
}

fn mean_distance_m(measured: &InverseDepth) -> f64 {
    let known = measured.values.iter().filter(|v| v.is_finite());
    let (sum, count) = known.fold((0.0, 0.0), |(sum, count), v| {
        (sum + f64::from(*v), count + 1.0)
    });
    if sum > 0.0 { count / sum } else { 0.0 }
}
