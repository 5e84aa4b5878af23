//! The depth filter: inverse depth with its information, from a moving camera's images.
//!
//! Per pixel a mean and an information of zeta = 1/Z (1/D for cameras that are not a pinhole), carried
//! along by the exact finite motion, corrected by comparing each image with several of the past, and
//! regularised by planes. In the spirit of the observers of Chapter 3, with the gain that the
//! information asks for.

mod carry;
mod config;
mod contest;
mod doubt;
mod edges;
mod faint;
mod gain;
mod impulses;
mod judge;
mod keyframes;
mod lags;
mod lattice;
mod lens;
mod motion;
mod output;
mod pair;
mod planes;
mod predict;
mod prepare;
mod rolling;
mod row_light;
mod seen;
mod slip;
mod splat;
mod state;
mod step;
mod steps;
mod surfaces;
mod update;

pub use config::{Brightness, DepthFilterConfig};
pub use motion::{PoseNoise, VelocityNoise};

use crate::{DepthReason, DepthStatus, Result};
use doubt::Doubt;
use keyframes::Keyframes;
use lattice::Lattice;
use motion::Motion;
use output::{Output, StdScale};
use planes::Planes;
use prepare::{Preparation, Prepared};
use sphereflow_core::{Plane, Pose, Stamp, Twist};
use sphereflow_raster::same_size;
use sphereflow_sphere::Camera;
use state::{Node, Past};
use std::collections::VecDeque;

/// Dense range from the images of a camera whose motion is known.
#[derive(Clone, Debug)]
pub struct DepthFilter {
    camera: Camera,
    config: DepthFilterConfig,
    lattice: Lattice,
    preparation: Preparation,
    planes: Planes,
    output: Output,
    motion: Motion,
    nodes: Vec<Node>,
    spare: Vec<Node>,
    nearest: Vec<f32>,
    trust: Vec<f32>,
    doubt: Doubt,
    /// The past, newest first.
    past: VecDeque<Past>,
    keyframes: Keyframes,
    updates: usize,
    /// Squared baselines over the variance of the poses, summed with memory: the information on the scale
    /// that all pixels share. Infinite for exact poses.
    scale_information: f64,
    /// Variance per axis of the rotation errors of pairs as measured, rad^2.
    turn_variance: f32,
    /// Relative variance of all ranges by places that are off as much as rotations are measured to be: the
    /// errors of frames that follow each other are one, and do not average out.
    shared_variance: f64,
    /// Growth of variances since the last update.
    stale: f32,
}

/// What a step has brought. The images are those of [`DepthFilter::range`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthStep {
    /// What became of the image.
    pub status: DepthStatus,
    /// Standard deviation of the image noise that the step used, grey levels of the binned image.
    pub sigma_grey: f32,
    /// Share of the compared pixels whose residual fits, 0 to 1; NaN where none was compared.
    pub fitting_share: f32,
}

/// Pixels' misfit that says nothing of curvature where impulses are left in the images, likewise.
const WITH_IMPULSES: f64 = 0.5;

/// How often the same noise comes into the state.
const NOISE_REPEATS: f32 = 2.0;

/// Information of a pixel before anything is measured, as a share of 1/x^2.
const INITIAL_SHARE: f32 = 0.5;

/// Errors of the poses' rotation bend the scene besides: on simulated rooms about as much again.
const COMMON_FACTOR: f64 = 2.0;

/// From the measured rotations' variance over the longest baseline to that of all ranges.
const SHARED_FACTOR: f64 = 3.0;

/// From the state's deviation to the errors seen on simulated rooms (`depth_accuracy`).
const STD_FACTOR: f32 = 1.2;

/// Relative error of slopes by differences and of images read between pixels, that no measurement takes away, for a
/// pixel of one radian: the finer pixels are, the less it is.
const FLOOR_PER_RAD: f32 = 0.05;

impl DepthFilter {
    /// For a camera.
    ///
    /// # Errors
    /// Value errors for settings out of their domain, or a camera too small for them.
    pub fn new(camera: &Camera, config: DepthFilterConfig) -> Result<Self> {
        config.check()?;
        let binned = camera.binned(config.binning)?;
        let lattice = Lattice::new(&binned)?;
        let pixels = lattice.width * lattice.height;
        let zeta = (1.0 / config.initial_range_m) as f32;
        let initial = [zeta, 0.0, INITIAL_SHARE / (zeta * zeta), zeta * zeta];
        let nodes: Vec<Node> = lattice
            .ray
            .iter()
            .map(|ray| {
                if ray.x.is_nan() {
                    [f32::NAN, 0.0, 0.0, f32::NAN]
                } else {
                    initial
                }
            })
            .collect();
        Ok(Self {
            preparation: Preparation::new(lattice.width, lattice.height, config.binning),
            planes: Planes::new(
                &lattice,
                config.roughness_per_m_rad / f64::from(lattice.focal_px),
                config.farthest_m,
            ),
            output: Output::new(camera, config.binning),
            motion: Motion::default(),
            spare: nodes.clone(),
            nodes,
            nearest: vec![0.0; pixels],
            trust: vec![1.0; pixels],
            doubt: Doubt::new(pixels),
            past: VecDeque::new(),
            keyframes: Keyframes::new(config.keyframes),
            updates: 0,
            scale_information: 0.0,
            turn_variance: 0.0,
            shared_variance: 0.0,
            stale: 1.0,
            camera: camera.clone(),
            lattice,
            config,
        })
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The next image, from a pose that is known exactly.
    ///
    /// A stamp that does not increase is skipped, with a reason.
    ///
    /// # Errors
    /// A shape error naming `image`; a value error for a pose that is not finite. The filter is as
    /// before.
    pub fn step(
        &mut self,
        image: &Plane<f32>,
        world_from_camera: &Pose,
        stamp: Stamp,
    ) -> Result<DepthStep> {
        self.step_with_noise(image, world_from_camera, PoseNoise::default(), stamp)
    }

    /// [`DepthFilter::step`] from a pose that is known up to a noise, which is the next pose's own. An error
    /// that many poses share does not matter.
    ///
    /// # Errors
    /// As [`DepthFilter::step`], and value errors for a noise that is negative or not finite.
    pub fn step_with_noise(
        &mut self,
        image: &Plane<f32>,
        world_from_camera: &Pose,
        noise: PoseNoise,
        stamp: Stamp,
    ) -> Result<DepthStep> {
        same_size("image", self.output.size(), image.size())?;
        let mut motion = self.motion;
        motion.set(*world_from_camera, noise, stamp)?;
        if !self.motion.follows(stamp) {
            return Ok(self.skipped());
        }
        self.motion = motion;
        Ok(self.advance(image))
    }

    /// The next image, `dt_s` after the one before, with the velocities between both and what is
    /// known of their errors. The motion is integrated exactly for velocities that are constant.
    ///
    /// # Errors
    /// A shape error naming `image`; value errors for velocities or a time that are not finite or not
    /// positive. The filter is as before.
    pub fn step_with_velocity(
        &mut self,
        image: &Plane<f32>,
        twist: &Twist,
        dt_s: f64,
        noise: VelocityNoise,
    ) -> Result<DepthStep> {
        same_size("image", self.output.size(), image.size())?;
        self.motion.integrate(twist, dt_s, noise)?;
        Ok(self.advance(image))
    }

    /// Range along the ray and its standard deviation, metres, (width, height) of the camera; NaN where
    /// the camera has no ray. Before anything is measured the deviation is as large as the range.
    pub fn range(&self) -> (Plane<f32>, Plane<f32>) {
        let (width, height) = self.output.size();
        let mut range = Plane::filled(width, height, f32::NAN);
        let mut std = range.clone();
        self.output.fill(
            &self.lattice,
            (&self.nodes, &self.trust, &self.doubt),
            self.std_scale(),
            &mut range,
            &mut std,
        );
        (range, std)
    }

    /// [`DepthFilter::range`] into the caller's planes.
    ///
    /// # Errors
    /// Shape errors naming the plane.
    pub fn range_into(&self, range: &mut Plane<f32>, std: &mut Plane<f32>) -> Result<()> {
        same_size("range", self.output.size(), range.size())?;
        same_size("std", self.output.size(), std.size())?;
        self.output.fill(
            &self.lattice,
            (&self.nodes, &self.trust, &self.doubt),
            self.std_scale(),
            range,
            std,
        );
        Ok(())
    }

    /// The pose of the last image, as given or integrated.
    pub fn world_from_camera(&self) -> Pose {
        self.motion.pose
    }

    /// With the relative error that all pixels share because the poses have one.
    fn std_scale(&self) -> StdScale {
        let common = if self.updates > 0 {
            (COMMON_FACTOR / self.scale_information + SHARED_FACTOR * self.shared_variance) as f32
        } else {
            0.0
        };
        StdScale {
            factor: STD_FACTOR,
            floor: FLOOR_PER_RAD / self.lattice.focal_px,
            common,
            stale: self.stale,
        }
    }

    fn skipped(&self) -> DepthStep {
        DepthStep {
            status: DepthStatus::Skipped(DepthReason::StampNotIncreasing),
            sigma_grey: f32::NAN,
            fitting_share: f32::NAN,
        }
    }

    /// Predict, compare, smooth, remember.
    fn advance_in_pool(&mut self, image: &Plane<f32>) -> DepthStep {
        let longest = self.config.lags[self.config.lags.len() - 1];
        let mut spent = None;
        if self.past.len() > longest {
            spent = self.past.pop_back();
        }
        let (buffer, surface) = match spent {
            Some(past) => (past.image, past.surface),
            None => (Prepared::empty(), Vec::new()),
        };
        let sigma = self.config.sigma_grey;
        let prepared = self
            .preparation
            .prepare(image, &self.lattice, sigma, buffer);
        self.predict();
        let mut step = DepthStep {
            status: self.verdict(&prepared),
            sigma_grey: prepared.sigma_raw,
            fitting_share: f32::NAN,
        };
        let usable = !matches!(step.status, DepthStatus::Unusable(_));
        if step.status == DepthStatus::Updated {
            self.update(&prepared, &mut step);
            // Images are compared several times over: noise counts a few times what smoothing leaves.
            let left = (prepared.sigma / prepared.sigma_raw).powi(2);
            let normal = f64::from(NOISE_REPEATS * left).clamp(0.05, 0.5);
            let pixel_noise = if prepared.impulses {
                WITH_IMPULSES
            } else {
                normal
            };
            self.planes
                .smooth(&self.lattice, &mut self.nodes, pixel_noise);
            self.updates += 1;
            self.stale = 1.0;
            if self.config.occlusion && self.updates >= self.config.start_frames {
                let present = self.motion.present();
                self.keyframes.keep(&self.lattice, &self.nodes, &present);
            }
        } else {
            // What is not measured is less and less certain, as its information fades.
            let growth = (1.0 / self.config.memory) as f32;
            self.nodes.iter_mut().for_each(|node| node[3] *= growth);
            self.stale *= growth;
        }
        self.remember(prepared, surface, usable);
        step
    }
}
