//! From a solution to an honest estimate: status, covariance, weak directions.

use super::RangeFlowConfig;
use super::equations::Solution;
use nalgebra::{Matrix6, Vector6};
use sphereflow_alignment::VelocityEstimate;
use sphereflow_alignment::observability::Cut;
use sphereflow_core::{Reason, TrackStatus, Twist};

/// What is known when the last level is solved.
pub(super) struct Verdict<'a> {
    pub(super) config: &'a RangeFlowConfig,
    pub(super) solution: &'a Solution,
    pub(super) twist: Twist,
    pub(super) dt_s: f64,
    /// Robust residual of a camera at rest, 1/m.
    pub(super) at_rest: f64,
    /// The last solve moved less than the one before.
    pub(super) settled: bool,
}

impl Verdict<'_> {
    pub(super) fn estimate(&self, known_share: f64, iterations: usize) -> VelocityEstimate {
        let (config, solution) = (self.config, self.solution);
        let status = self.status();
        if let TrackStatus::Lost(reason) = status {
            return VelocityEstimate {
                residual_scale: solution.scale / config.block_noise,
                mean_range_m: solution.mean_range_m,
                domains: solution.blocks,
                iterations,
                ..lost(reason, known_share)
            };
        }
        let limit = Cut::of_score(config.unobservable_score);
        let formal = solution.spectrum.covariance(
            &solution.normal,
            solution.variance * config.covariance.scale.powi(2) / self.dt_s.powi(2),
            limit,
            config.unobservable_std_m_s,
        );
        VelocityEstimate {
            status,
            twist: Some(self.twist),
            covariance: Some(formal + self.floor()),
            score: solution.spectrum.score(),
            weak_directions: solution
                .spectrum
                .weak_directions(&formal, config.weak_score, limit),
            known_share,
            domains: solution.blocks,
            residual_scale: solution.scale / config.block_noise,
            mean_range_m: solution.mean_range_m,
            iterations,
            ..lost(Reason::NotConverged, known_share)
        }
    }

    fn status(&self) -> TrackStatus {
        let config = self.config;
        let (speed_m_s, rate_rad_s) = (
            self.twist.linear_m_s.norm(),
            self.twist.angular_rad_s.norm(),
        );
        let scale = self.solution.scale / config.block_noise;
        let score = self.solution.spectrum.score();
        let unexplained = config.max_unexplained_share * self.at_rest / config.block_noise;
        let largest = unexplained.max(config.good_residual_scale);
        if scale > config.max_residual_scale.min(largest) {
            TrackStatus::Lost(Reason::PoorFit { scale })
        } else if speed_m_s > config.max_speed_m_s || rate_rad_s > config.max_rate_rad_s {
            TrackStatus::Lost(Reason::ImplausibleMotion {
                speed_m_s,
                rate_rad_s,
            })
        } else if !self.settled {
            TrackStatus::Lost(Reason::NotConverged)
        } else if score < config.weak_score.max(config.unobservable_score) {
            TrackStatus::Weak(Reason::Unobservable { score })
        } else {
            TrackStatus::Tracked
        }
    }

    /// The part of the covariance that the residuals do not show: see [`sphereflow_alignment::CovarianceModel`].
    fn floor(&self) -> Matrix6<f64> {
        let (model, range_m) = (&self.config.covariance, self.solution.mean_range_m);
        let speed = self.twist.linear_m_s.norm() + range_m * self.twist.angular_rad_s.norm();
        let linear = (model.floor_m / self.dt_s + model.motion_share * speed).powi(2);
        let angular = linear / (range_m * range_m);
        Matrix6::from_diagonal(&Vector6::new(
            angular, angular, angular, linear, linear, linear,
        ))
    }
}

/// Nothing was measured.
pub(super) fn lost(reason: Reason, known_share: f64) -> VelocityEstimate {
    VelocityEstimate::lost(reason, known_share)
}
