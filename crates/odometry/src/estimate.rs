//! The velocity between two depth images: block means, weak form, robust solve, status.

use crate::Result;
use crate::binning::{BlockRule, InverseDepth};
use crate::config::Config;
use crate::depth_image::DepthImage;
use crate::motion::{pose_from_twist, twist_from_pose};
use crate::observability::WeakDirection;
use crate::robust::{RobustSolver, Solution};
use crate::sphere_table::SphereTable;
use crate::tiling::Tiling;
use crate::warp::Warp;
use crate::weak_form::{CellSums, Pair, WeakForm};
use nalgebra::{Matrix6, Vector6};
use sphereflow_core::{Error, Pose, Reason, TrackStatus, Twist};
use sphereflow_sphere::Camera;

/// What two depth images say of the camera's velocity.
#[derive(Clone, Debug, PartialEq)]
pub struct VelocityEstimate {
    /// `Tracked`, `Weak` with a reason, or `Lost` with a reason.
    pub status: TrackStatus,
    /// Velocity in the camera's own frame, constant between the images: `log(R, p) / dt` of the
    /// motion `first_from_second`. `None` where lost.
    pub twist: Option<Twist>,
    /// Covariance of the twist in the order `[omega, v]`, with [`crate::CovarianceModel`] applied.
    /// `None` where lost.
    ///
    /// Thesis: section 6.4
    pub covariance: Option<Matrix6<f64>>,
    /// 0 (some direction of motion changes nothing) to 1; square root of smallest over largest
    /// eigenvalue of the information, rotations scaled by the mean range.
    ///
    /// Thesis: Theorem 3
    pub score: f64,
    /// Directions below [`Config::weak_score`].
    pub weak_directions: Vec<WeakDirection>,
    /// Share of blocks known in both images, 0 to 1.
    pub known_share: f64,
    /// Usable domains.
    pub domains: usize,
    /// Robust residual in units of [`Config::domain_noise`]; NaN where nothing was solved.
    pub residual_scale: f64,
    /// Mean range of the scene, metres; NaN where nothing was solved.
    pub mean_range_m: f64,
    /// Solves of the normal equations.
    pub iterations: usize,
}

/// Further warps where the last one moved more than the one before: noise does that at times, and
/// one more then settles; a solve that still grows after these has not converged.
const PATIENCE: usize = 2;

/// Velocity between two depth images of one camera.
///
/// # Errors
/// A core shape error where an image is not of the camera's size, a value error where `dt_s` is
/// not positive or a setting is out of range. Images that cannot be used are no errors: see the
/// status.
pub fn estimate_velocity<'a>(
    camera: &Camera,
    first: impl Into<DepthImage<'a>>,
    second: impl Into<DepthImage<'a>>,
    dt_s: f64,
    config: &Config,
) -> Result<VelocityEstimate> {
    VelocityEstimator::new(camera, *config)?.estimate(first, second, dt_s)
}

/// [`estimate_velocity`] for many pairs: tables and working memory are kept between calls.
///
/// Thesis: section 6.2
#[derive(Clone, Debug)]
pub struct VelocityEstimator {
    camera: Camera,
    binned: Camera,
    config: Config,
    table: SphereTable,
    tiling: Tiling,
    first: InverseDepth,
    second: InverseDepth,
    warped: InverseDepth,
    pair: Pair,
    sums: Vec<CellSums>,
    solver: RobustSolver,
}

impl VelocityEstimator {
    /// Prepares the tables of `camera`.
    ///
    /// # Errors
    /// Where a setting is out of range or the image is smaller than a block.
    pub fn new(camera: &Camera, config: Config) -> Result<Self> {
        config.validate()?;
        let binned = camera.binned(config.block)?;
        Ok(Self {
            table: SphereTable::new(camera, config.block)?,
            tiling: Tiling::new(binned.width(), binned.height(), config.domains),
            camera: camera.clone(),
            binned,
            config,
            first: InverseDepth::default(),
            second: InverseDepth::default(),
            warped: InverseDepth::default(),
            pair: Pair::default(),
            sums: Vec::new(),
            solver: RobustSolver::default(),
        })
    }

    /// The settings.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Velocity between two images `dt_s` seconds apart.
    ///
    /// # Errors
    /// As [`estimate_velocity`].
    pub fn estimate<'a>(
        &mut self,
        first: impl Into<DepthImage<'a>>,
        second: impl Into<DepthImage<'a>>,
        dt_s: f64,
    ) -> Result<VelocityEstimate> {
        if !(dt_s.is_finite() && dt_s > 0.0) {
            return Err(Error::value("dt_s", "a positive number of seconds", dt_s).into());
        }
        let mut images = (
            std::mem::take(&mut self.first),
            std::mem::take(&mut self.second),
        );
        self.average(&first.into(), "depth0", &mut images.0)?;
        self.average(&second.into(), "depth1", &mut images.1)?;
        let estimate = self.solve(&images.0, &images.1, dt_s, &Twist::default());
        (self.first, self.second) = images;
        Ok(estimate)
    }

    /// Block averages of an image of the camera's size.
    pub(crate) fn average(
        &self,
        image: &DepthImage<'_>,
        argument: &str,
        out: &mut InverseDepth,
    ) -> Result<()> {
        let (width, height) = (self.camera.width(), self.camera.height());
        if image.size() != (width, height) {
            let (w, h) = image.size();
            let expected = format!("{width}x{height} pixels as the camera");
            return Err(Error::shape(argument, expected, format!("{w}x{h} pixels")).into());
        }
        let rule = BlockRule {
            block: self.config.block,
            known_share: self.config.block_known_share as f32,
            max_spread: self.config.max_jump as f32,
        };
        out.average(image, rule);
        Ok(())
    }

    /// The velocity between two averaged images; `prior` serves the directions that the scene does
    /// not determine.
    pub(crate) fn solve(
        &mut self,
        first: &InverseDepth,
        second: &InverseDepth,
        dt_s: f64,
        prior: &Twist,
    ) -> VelocityEstimate {
        self.pair.fill(&self.table, first, second);
        let known_share = self.pair.known_share();
        if known_share < self.config.min_known_share {
            return VelocityEstimate::lost(
                Reason::FewKnownPixels { share: known_share },
                known_share,
            );
        }
        let mut solution = match self.solve_pair(dt_s, Some(&prior.vector())) {
            Ok(solution) => solution,
            Err(reason) => return VelocityEstimate::lost(reason, known_share),
        };
        let scale_at_rest = solution.scale_at_rest;
        let mut motion = pose_from_twist(&Twist::from_vector(&solution.twist), dt_s);
        let (mut step_m, mut settled) = (f64::INFINITY, true);
        let (wanted, most) = (self.config.warps, self.config.warps + PATIENCE);
        let mut solves = 1;
        while solves <= wanted || (!settled && solves <= most) {
            solves += 1;
            self.warp(first, second, motion);
            solution = match self.solve_pair(dt_s, None) {
                Ok(solution) => solution,
                Err(reason) => return VelocityEstimate::lost(reason, known_share),
            };
            let step = Twist::from_vector(&solution.twist);
            motion = pose_from_twist(&step, dt_s) * motion;
            let size = motion_m(&step, dt_s, solution.mean_range_m);
            settled = size < step_m.max(self.config.covariance.floor_m);
            step_m = size;
        }
        solution.scale_at_rest = scale_at_rest; // that of the images, not of the warped ones
        self.judge(&solution, motion, dt_s, known_share, settled, solves)
    }

    /// Weak form and robust solve of the current pair: from nothing but a prior, or, of a pair that
    /// was warped, from rest.
    fn solve_pair(
        &mut self,
        dt_s: f64,
        prior: Option<&Vector6<f64>>,
    ) -> std::result::Result<Solution, Reason> {
        WeakForm {
            table: &self.table,
            tiling: &self.tiling,
            pair: &self.pair,
            max_jump: self.config.max_jump as f32,
        }
        .accumulate(&mut self.sums);
        let share = self.config.domain_known_share;
        let found = self.solver.take(&self.sums, &self.tiling, dt_s, share);
        if found < self.config.min_domains {
            return Err(Reason::FewDomains {
                found,
                needed: self.config.min_domains,
            });
        }
        let rest = Vector6::zeros();
        let solution = match prior {
            Some(prior) => self.solver.solve(&self.config, dt_s, prior),
            None => self.solver.solve_from(&self.config, dt_s, &rest, rest),
        };
        let finite = solution.twist.iter().all(|v| v.is_finite());
        if finite {
            Ok(solution)
        } else {
            Err(Reason::NotConverged)
        }
    }

    /// Replaces the pair by the first image and the second one seen from the first's pose.
    fn warp(&mut self, first: &InverseDepth, second: &InverseDepth, motion: Pose) {
        Warp {
            camera: &self.binned,
            table: &self.table,
            second,
            motion,
            max_jump: self.config.max_jump as f32,
        }
        .fill(first, &mut self.warped);
        self.pair.fill(&self.table, first, &self.warped);
    }

    fn judge(
        &self,
        solution: &Solution,
        motion: Pose,
        dt_s: f64,
        known_share: f64,
        settled: bool,
        solves: usize,
    ) -> VelocityEstimate {
        let config = &self.config;
        let twist = twist_from_pose(&motion, dt_s);
        let score = solution.spectrum.score();
        let (limit, unseen) = (config.unobservable_score, config.unobservable_std_m_s);
        let status = self.status(solution, &twist, settled);
        let has_twist = status.has_pose();
        let variance = solution.variance * config.covariance.scale.powi(2);
        let formal = solution
            .spectrum
            .covariance(&solution.normal, variance, limit, unseen);
        VelocityEstimate {
            status,
            twist: has_twist.then_some(twist),
            covariance: has_twist
                .then(|| formal + covariance_floor(config, &twist, dt_s, solution.mean_range_m)),
            score,
            weak_directions: solution
                .spectrum
                .weak_directions(&formal, config.weak_score, limit),
            known_share,
            domains: solution.domains,
            residual_scale: solution.scale,
            mean_range_m: solution.mean_range_m,
            iterations: (config.sweeps + 1) * solves,
        }
    }

    fn status(&self, solution: &Solution, twist: &Twist, settled: bool) -> TrackStatus {
        let config = &self.config;
        let (speed_m_s, rate_rad_s) = (twist.linear_m_s.norm(), twist.angular_rad_s.norm());
        let score = solution.spectrum.score();
        let unexplained = config.max_unexplained_share * solution.scale_at_rest;
        if solution.scale
            > config
                .max_residual_scale
                .min(unexplained.max(config.good_residual_scale))
        {
            TrackStatus::Lost(Reason::PoorFit {
                scale: solution.scale,
            })
        } else if speed_m_s > config.max_speed_m_s || rate_rad_s > config.max_rate_rad_s {
            TrackStatus::Lost(Reason::ImplausibleMotion {
                speed_m_s,
                rate_rad_s,
            })
        } else if !settled {
            TrackStatus::Lost(Reason::NotConverged)
        } else if score < config.weak_score.max(config.unobservable_score) {
            TrackStatus::Weak(Reason::Unobservable { score })
        } else {
            TrackStatus::Tracked
        }
    }
}

impl VelocityEstimate {
    fn lost(reason: Reason, known_share: f64) -> Self {
        Self {
            status: TrackStatus::Lost(reason),
            twist: None,
            covariance: None,
            score: 0.0,
            weak_directions: Vec::new(),
            known_share,
            domains: 0,
            residual_scale: f64::NAN,
            mean_range_m: f64::NAN,
            iterations: 0,
        }
    }
}

/// Motion over a pair in metres: rotation counts at the scene's mean range.
fn motion_m(twist: &Twist, dt_s: f64, range_m: f64) -> f64 {
    (twist.linear_m_s.norm() + range_m * twist.angular_rad_s.norm()) * dt_s
}

/// The part of the covariance that the residuals do not show: see [`crate::CovarianceModel`].
fn covariance_floor(config: &Config, twist: &Twist, dt_s: f64, range_m: f64) -> Matrix6<f64> {
    let model = &config.covariance;
    let moved = motion_m(twist, dt_s, range_m);
    let linear = ((model.floor_m + model.motion_share * moved) / dt_s).powi(2);
    let angular = linear / (range_m * range_m);
    Matrix6::from_diagonal(&Vector6::new(
        angular, angular, angular, linear, linear, linear,
    ))
}
