//! The velocity between two depth images as the thesis computed it, with a status.

use super::balance::Balance;
use super::config::ThesisConfig;
use super::domains::Domains;
use super::solve::{Rows, Solution};
use super::table::EdgeTable;
use crate::Result;
use sphereflow_alignment::observability::Cut;
use sphereflow_alignment::{DepthImage, PairInput, VelocityEstimate};
use sphereflow_core::{Reason, TrackStatus, Twist};
use sphereflow_sphere::Camera;

/// The thesis's method for many pairs of images of one camera: tables and working memory are kept
/// between calls.
///
/// Thesis: section 6.2, section 6.3, section 6.4
#[derive(Clone, Debug)]
pub struct ThesisEstimator {
    camera: Camera,
    config: ThesisConfig,
    balance: Balance,
    rows: Rows,
}

impl ThesisEstimator {
    /// Prepares the tables of `camera`.
    ///
    /// # Errors
    /// A core value error where a setting is out of range, or where the thesis has no table for
    /// the camera: it has them for a pinhole without skew and for the FOV fish-eye.
    pub fn new(camera: &Camera, config: ThesisConfig) -> Result<Self> {
        config.validate()?;
        let table = EdgeTable::new(camera)?;
        let (width, height) = (camera.width(), camera.height());
        let domains = Domains::new(width, height, config.domains, config.overlap);
        Ok(Self {
            camera: camera.clone(),
            config,
            balance: Balance::new(camera, &table, domains),
            rows: Rows::default(),
        })
    }

    /// The settings.
    pub fn config(&self) -> &ThesisConfig {
        &self.config
    }

    /// Velocity between two images `dt_s` seconds apart, in the camera's frame. Domains in which a
    /// pixel is unknown in either image are left out, as in the thesis. The covariance is that of
    /// section 6.4, without the floors of [`sphereflow_alignment::CovarianceModel`]. `known_share` counts pixels.
    ///
    /// # Errors
    /// A core shape error where an image is not of the camera's size, a value error where `dt_s` is
    /// not positive. Images that cannot be used are no errors: see the status.
    pub fn estimate<'a>(
        &mut self,
        first: impl Into<DepthImage<'a>>,
        second: impl Into<DepthImage<'a>>,
        dt_s: f64,
    ) -> Result<VelocityEstimate> {
        let PairInput { first, second, .. } =
            PairInput::checked(&self.camera, first, second, dt_s)?;
        let known = self.balance.accumulate(&first, &second, self.config.time);
        if known < self.config.limits.min_known_share {
            return Ok(lost(Reason::FewKnownPixels { share: known }, known, 0));
        }
        let found = self.rows.take(&self.balance, dt_s);
        let needed = self.config.min_domains;
        if found < needed {
            return Ok(lost(Reason::FewDomains { found, needed }, known, found));
        }
        let solution = self.rows.solve(&self.config, dt_s);
        Ok(self.judge(&solution, known, found))
    }

    fn judge(&self, solution: &Solution, known_share: f64, domains: usize) -> VelocityEstimate {
        let limits = &self.config.limits;
        let status = self.status(solution);
        let has_twist = status.has_pose();
        VelocityEstimate {
            status,
            twist: has_twist.then(|| Twist::from_vector(&solution.twist)),
            covariance: has_twist.then_some(solution.covariance),
            score: solution.spectrum.score(),
            weak_directions: solution.spectrum.weak_directions(
                &solution.covariance,
                limits.weak_score,
                Cut::of_score(limits.unobservable_score),
            ),
            known_share,
            domains,
            residual_scale: solution.scale,
            mean_range_m: solution.mean_range_m,
            iterations: 1,
            ..lost(Reason::NotConverged, known_share, domains)
        }
    }

    fn status(&self, solution: &Solution) -> TrackStatus {
        let limits = &self.config.limits;
        let finite = solution.twist.iter().all(|v| v.is_finite());
        if !finite || !solution.covariance.iter().all(|v| v.is_finite()) {
            return TrackStatus::Lost(Reason::NotConverged);
        }
        let twist = Twist::from_vector(&solution.twist);
        let (speed_m_s, rate_rad_s) = (twist.linear_m_s.norm(), twist.angular_rad_s.norm());
        let score = solution.spectrum.score();
        let unexplained = limits.max_unexplained_share * solution.scale_at_rest;
        let most = limits
            .max_residual_scale
            .min(unexplained.max(limits.good_residual_scale));
        if solution.scale > most {
            TrackStatus::Lost(Reason::PoorFit {
                scale: solution.scale,
            })
        } else if speed_m_s > limits.max_speed_m_s || rate_rad_s > limits.max_rate_rad_s {
            TrackStatus::Lost(Reason::ImplausibleMotion {
                speed_m_s,
                rate_rad_s,
            })
        } else if score < limits.weak_score.max(limits.unobservable_score) {
            TrackStatus::Weak(Reason::Unobservable { score })
        } else {
            TrackStatus::Tracked
        }
    }
}

fn lost(reason: Reason, known_share: f64, domains: usize) -> VelocityEstimate {
    VelocityEstimate {
        domains,
        ..VelocityEstimate::lost(reason, known_share)
    }
}
