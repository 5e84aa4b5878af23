//! Point-wise range flow: what the weak form of Chapter 6 is measured against.
//!
//! Every block of pixels gives one equation of the flow of its inverse range, whose gradient is a
//! central difference (Spies, Jähne and Barron 2002; DIFODO, Jaimez and Gonzalez-Jimenez 2015). It
//! is solved by reweighted least squares on a pyramid of block means, the second image warped by
//! what the coarser levels found. The noise of the gradients shrinks its velocities, which the weak
//! form, free of gradients, does not suffer; without noise it is as exact.

mod config;
mod equations;
mod level;
mod verdict;

pub use config::RangeFlowConfig;

use crate::Result;
use equations::{Equations, Solution};
use level::Level;
use nalgebra::Vector6;
use sphereflow_alignment::{
    DepthImage, PairInput, VelocityEstimate, pose_from_twist, twist_from_pose,
};
use sphereflow_core::{Error, Pose, Reason, Twist};
use sphereflow_sphere::Camera;
use verdict::{Verdict, lost};

/// Further solves on the finest level where the last one moved more than the one before.
const PATIENCE: usize = 2;

/// Velocities between depth images by point-wise range flow, for any central camera.
///
/// Tables and working memory are kept between calls. Results do not depend on the number of threads.
#[derive(Clone, Debug)]
pub struct RangeFlow {
    camera: Camera,
    config: RangeFlowConfig,
    levels: Vec<Level>,
    equations: Equations,
}

impl RangeFlow {
    /// Prepares the tables of `camera`.
    ///
    /// # Errors
    /// A core value error where a setting is out of range or the image is too small for a level.
    pub fn new(camera: &Camera, config: RangeFlowConfig) -> Result<Self> {
        config.validate(camera)?;
        let levels = config
            .levels
            .iter()
            .map(|&block| Level::new(camera, block))
            .collect::<Result<_>>()?;
        Ok(Self {
            camera: camera.clone(),
            config,
            levels,
            equations: Equations::default(),
        })
    }

    /// The settings.
    pub fn config(&self) -> &RangeFlowConfig {
        &self.config
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Velocity between two images `dt_s` seconds apart: `[omega, v]` in the camera's frame at the
    /// first image, constant over the interval. [`VelocityEstimate::domains`] counts the blocks of
    /// the finest level that had an equation, [`VelocityEstimate::residual_scale`] is in units of
    /// [`RangeFlowConfig::block_noise`].
    ///
    /// # Errors
    /// A core shape error where an image is not of the camera's size, a value error where `dt_s` is
    /// not positive or the images are of two kinds. Images that cannot be used are no errors: see
    /// the status.
    pub fn estimate<'a>(
        &mut self,
        first: impl Into<DepthImage<'a>>,
        second: impl Into<DepthImage<'a>>,
        dt_s: f64,
    ) -> Result<VelocityEstimate> {
        self.estimate_from(first, second, dt_s, &Pose::identity())
    }

    /// [`Self::estimate`] from a first guess of the motion `first_from_second`. Directions that the
    /// scene does not determine keep the guess.
    ///
    /// # Errors
    /// As [`Self::estimate`].
    pub fn estimate_from<'a>(
        &mut self,
        first: impl Into<DepthImage<'a>>,
        second: impl Into<DepthImage<'a>>,
        dt_s: f64,
        guess: &Pose,
    ) -> Result<VelocityEstimate> {
        let PairInput { first, second, .. } =
            PairInput::checked(&self.camera, first, second, dt_s)?;
        if first.axis() != second.axis() {
            let expected = "the kind of depth0, depth or range";
            return Err(Error::value("depth1", expected, "the other"));
        }
        for level in &mut self.levels {
            level.take(&first, &second, &self.config);
        }
        Ok(self.solve(dt_s, *guess))
    }

    fn solve(&mut self, dt_s: f64, guess: Pose) -> VelocityEstimate {
        let finest = self.levels.len() - 1;
        let (known_share, at_rest) = match self.before(finest) {
            Ok(found) => found,
            Err(verdict) => return *verdict,
        };
        let mut motion = guess;
        let mut last: Option<(Solution, f64)> = None;
        let (mut settled, mut solves) = (true, 0);
        for step in 0..=finest + PATIENCE {
            if step > finest && settled {
                break;
            }
            let index = step.min(finest);
            let warp = (motion != Pose::identity()).then_some(motion);
            let solution = match self.solve_level(index, warp) {
                Ok(solution) => solution,
                Err(reason) if index == finest => return lost(reason, known_share),
                Err(_) => continue, // a coarse level only brings the finer ones near
            };
            solves += 1;
            let found = Twist::from_vector(&solution.motion);
            motion = pose_from_twist(&found, 1.0) * motion;
            let size = solution.motion.fixed_rows::<3>(3).norm()
                + solution.mean_range_m * solution.motion.fixed_rows::<3>(0).norm();
            let before = last.as_ref().map_or(f64::INFINITY, |(_, size)| *size);
            settled = size < before.max(self.config.covariance.floor_m);
            last = Some((solution, size));
        }
        let Some((solution, _)) = last else {
            return lost(Reason::NotConverged, known_share);
        };
        Verdict {
            config: &self.config,
            solution: &solution,
            twist: twist_from_pose(&motion, dt_s),
            dt_s,
            at_rest,
            settled,
        }
        .estimate(known_share, (self.config.sweeps + 1) * solves)
    }

    /// Share of known blocks, and the robust residual of a camera at rest; or why there is nothing
    /// to solve.
    fn before(&mut self, finest: usize) -> std::result::Result<(f64, f64), Box<VelocityEstimate>> {
        let level = &mut self.levels[finest];
        level.compare(None, &self.config);
        let share = level.known_share();
        if share < self.config.min_known_share {
            return Err(Box::new(lost(Reason::FewKnownPixels { share }, share)));
        }
        level.rows(self.config.max_jump as f32, &mut self.equations.rows);
        Ok((share, self.equations.scale(&Vector6::zeros())))
    }

    fn solve_level(
        &mut self,
        index: usize,
        motion: Option<Pose>,
    ) -> std::result::Result<Solution, Reason> {
        let level = &mut self.levels[index];
        level.compare(motion, &self.config);
        level.rows(self.config.max_jump as f32, &mut self.equations.rows);
        let (found, needed) = (self.equations.rows.len(), self.config.min_blocks);
        if found < needed {
            return Err(Reason::FewDomains { found, needed });
        }
        let solution = self.equations.solve(&self.config, motion.is_some());
        if solution.motion.iter().all(|v| v.is_finite()) {
            Ok(solution)
        } else {
            Err(Reason::NotConverged)
        }
    }
}
