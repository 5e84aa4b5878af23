//! What an alignment says: the motion, its covariance, and whether it is to be believed.

use crate::config::Config;
use crate::motion::size_m;
use crate::observability::WeakDirection;
use crate::robust::Solution;
use crate::second_motion::SecondMotion;
use nalgebra::{Matrix6, Vector6};
use sphereflow_core::{Pose, Reason, TrackStatus, Twist};
use sphereflow_sphere::lie::se3;

/// Standard deviation by which each of two motions may be drawn aside, as a share of their distance.
const DRAWN_ASIDE: f64 = 0.15;

/// Two frames aligned, or why not.
#[derive(Clone, Debug)]
pub struct Alignment {
    /// `Tracked`, `Weak` with a reason, or `Lost` with a reason. Speeds are not judged: the time
    /// between the frames is not known here.
    pub status: TrackStatus,
    /// `keyframe_from_frame`; the first guess where nothing was solved.
    pub motion: Pose,
    /// Covariance of the motion, `[rotation, translation]` (radians, metres) in the keyframe's
    /// frame, with [`crate::CovarianceModel`] applied: of the `xi` in `exp(xi) * motion`. Directions
    /// that were not estimated have the variance of [`Config::unobservable_std_m_s`] over a second.
    /// `None` where nothing was solved.
    pub covariance: Option<Matrix6<f64>>,
    /// Share of the keyframe's blocks known in both, 0 to 1.
    pub known_share: f64,
    /// Share of the keyframe's surface that lies within the frame, 0 to 1; NaN where nothing was
    /// solved.
    pub overlap: f64,
    /// Median displacement, pixels of the full image; NaN where nothing was solved.
    pub flow_px: f64,
    /// Square root of smallest over largest eigenvalue of the information, rotations scaled by the
    /// mean range: 0 (some motion changes nothing) to 1; 0 where nothing was solved.
    ///
    /// Thesis: Theorem 3
    pub score: f64,
    /// Directions that were estimated, 0 to 6; the others have the prior's value.
    pub rank: usize,
    /// Robust residual in units of [`Config::domain_noise`]; NaN where nothing was solved.
    pub residual_scale: f64,
    /// Share of the domains that do not move with the rest; NaN where nothing was solved.
    pub rejected_share: f64,
    /// What clearly moves otherwise, as one.
    pub second_motion: SecondMotion,
    /// Usable domains.
    pub domains: usize,
    /// Mean range of the scene, metres; NaN where nothing was solved.
    pub mean_range_m: f64,
    /// False where the steps still grew.
    pub settled: bool,
    /// Solves of the normal equations.
    pub solves: usize,
    /// Last solve.
    solution: Option<Solution>,
}

/// A descent through the levels that came to its end.
#[derive(Clone, Debug)]
pub(super) struct Solved {
    pub(super) motion: Pose,
    pub(super) solution: Solution,
    pub(super) scale_at_start: f64,
    pub(super) known_share: f64,
    pub(super) overlap: f64,
    pub(super) flow_px: f64,
    pub(super) second_motion: SecondMotion,
    pub(super) settled: bool,
    pub(super) solves: usize,
}

impl Alignment {
    pub(super) fn of(config: &Config, solved: Solved) -> Self {
        let solution = solved.solution;
        let mut alignment = Self {
            status: TrackStatus::Tracked,
            motion: solved.motion,
            covariance: None,
            known_share: solved.known_share,
            overlap: solved.overlap,
            flow_px: solved.flow_px,
            score: solution.spectrum.score(),
            rank: solution.spectrum.rank(solution.cut),
            residual_scale: solution.scale,
            rejected_share: solution.rejected_share,
            second_motion: solved.second_motion,
            domains: solution.domains,
            mean_range_m: solution.mean_range_m,
            settled: solved.settled,
            solves: solved.solves,
            solution: Some(solution),
        };
        alignment.status = alignment.judged(config, solved.scale_at_start);
        let moved = se3::log(&alignment.motion);
        let twist = Twist::from_vector(&moved);
        alignment.covariance = alignment.velocity_covariance(config, &twist, 1.0);
        alignment
    }

    /// Nothing was solved.
    pub(super) fn unsolved(guess: Pose, reason: Reason, known_share: f64) -> Self {
        Self {
            status: TrackStatus::Lost(reason),
            motion: guess,
            covariance: None,
            known_share,
            overlap: f64::NAN,
            flow_px: f64::NAN,
            score: 0.0,
            rank: 0,
            residual_scale: f64::NAN,
            rejected_share: f64::NAN,
            second_motion: SecondMotion::default(),
            domains: 0,
            mean_range_m: f64::NAN,
            settled: false,
            solves: 0,
            solution: None,
        }
    }

    /// Inverse of the covariance; zero where nothing was solved.
    pub fn information(&self) -> Matrix6<f64> {
        self.covariance
            .and_then(|covariance| covariance.try_inverse())
            .unwrap_or_default()
    }

    /// Covariance that the residuals show, `[omega, v]` (rad/s, m/s) over `dt_s` seconds: without
    /// the floors of [`crate::CovarianceModel`] (they add up from pair to pair otherwise than noise
    /// does), with its factor. With `dt_s = 1` that of the motion itself, radians and metres.
    /// `None` where nothing was solved.
    pub fn formal_covariance(&self, config: &Config, dt_s: f64) -> Option<Matrix6<f64>> {
        let solution = self.solution.as_ref()?;
        let variance = solution.variance * config.covariance.scale.powi(2);
        let unseen = config.unobservable_std_m_s * dt_s;
        let covariance =
            solution
                .spectrum
                .covariance(&solution.normal, variance, solution.cut, unseen);
        Some(covariance / (dt_s * dt_s))
    }

    /// Covariance of the velocity `twist` over the last `dt_s` seconds, which this alignment
    /// measured: the residuals' part, the floor that [`crate::CovarianceModel`] gives a motion of
    /// that size, and the distance of a second motion. `None` where nothing was solved.
    pub fn velocity_covariance(
        &self,
        config: &Config,
        twist: &Twist,
        dt_s: f64,
    ) -> Option<Matrix6<f64>> {
        let formal = self.formal_covariance(config, dt_s)?;
        Some(formal + self.covariance_floor(config, twist, dt_s) + self.divided_covariance(dt_s))
    }

    /// Directions below [`Config::weak_score`], or that were not estimated, with their standard
    /// deviations over `dt_s` seconds.
    pub fn weak_directions(&self, config: &Config, dt_s: f64) -> Vec<WeakDirection> {
        let (Some(solution), Some(formal)) = (&self.solution, self.formal_covariance(config, dt_s))
        else {
            return Vec::new();
        };
        solution
            .spectrum
            .weak_directions(&formal, config.weak_score, solution.cut)
    }

    fn judged(&self, config: &Config, scale_at_start: f64) -> TrackStatus {
        let unexplained = config.max_unexplained_share * scale_at_start;
        let limit = unexplained.max(config.good_residual_scale);
        let (scale, score, share) = (self.residual_scale, self.score, self.second_motion.share);
        if scale > config.max_residual_scale.min(limit) {
            TrackStatus::Lost(Reason::PoorFit { scale })
        } else if !self.settled {
            TrackStatus::Lost(Reason::NotConverged)
        } else if share >= config.max_divided_share {
            TrackStatus::Weak(Reason::Divided { share })
        } else if score < config.weak_score || self.rank < 6 {
            TrackStatus::Weak(Reason::Unobservable { score })
        } else {
            TrackStatus::Tracked
        }
    }

    /// Where the scene moves as two, the motion sought may be either's: the part of a mixture's
    /// covariance that is due to their distance. Either is drawn aside by the domains of the other,
    /// in any direction.
    fn divided_covariance(&self, dt_s: f64) -> Matrix6<f64> {
        let SecondMotion { share, step } = self.second_motion;
        let step = step / dt_s;
        let aside = (DRAWN_ASIDE * size_m(&step, self.mean_range_m)).powi(2);
        share * (step * step.transpose() + of_metres(aside, self.mean_range_m))
    }

    /// The part of the covariance that the residuals do not show: see [`crate::CovarianceModel`].
    fn covariance_floor(&self, config: &Config, twist: &Twist, dt_s: f64) -> Matrix6<f64> {
        let model = &config.covariance;
        let moved = size_m(&(twist.vector() * dt_s), self.mean_range_m);
        let linear = ((model.floor_m + model.motion_share * moved) / dt_s).powi(2);
        of_metres(linear, self.mean_range_m)
    }
}

/// Covariance of `[omega, v]` with the same variance in all directions, m^2/s^2, where rotation counts
/// at the mean range.
fn of_metres(variance: f64, range_m: f64) -> Matrix6<f64> {
    let angular = variance / (range_m * range_m);
    Matrix6::from_diagonal(&Vector6::new(
        angular, angular, angular, variance, variance, variance,
    ))
}
