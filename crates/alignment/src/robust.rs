//! The robust solution of the domains' balances for one twist.

use crate::cell_sums::CellSums;
use crate::config::Config;
use crate::motion::size_m;
use crate::observability::{Cut, Spectrum};
use crate::rows::Row;
use crate::second_motion::{self, Found, SecondMotion};
use crate::tiling::Tiling;
use nalgebra::{Matrix6, Vector6};
use sphereflow_core::statistics::mad_sigma_mut;

/// Cauchy's constant in units of the median absolute residual's sigma: 95 % efficiency.
const CAUCHY: f64 = 2.385;
/// Smallest scale in units of the noise. On exact data the median residual is that of rounding on the
/// largest plane; weights that sharp hold the solve at whatever it began with, in the directions that
/// few domains determine.
const SMALLEST_SCALE: f64 = 1e-3;
/// Below this scale, in units of the noise, data count as free of it. The weights then span orders of
/// magnitude and settle slowly, so that further solves follow until a step is this share of what the
/// noise would move the scene.
const CLEAN_SCALE: f64 = 0.05;
const CLEAN_STEP: f64 = 1e-3;
const CLEAN_SWEEPS: usize = 24;
/// On depth without noise the domains of the largest plane fit exactly and would alone have a
/// weight, but a plane determines three of the six velocities only: every domain keeps this share
/// of the weight that it has at the level of the noise. Small, as creases bias their domains.
const LEAST_SHARE: f64 = 1e-3;

/// A domain with less weight than this, at the level of the noise, does not move with the rest:
/// residuals beyond some five sigma.
const REJECTED: f64 = 0.2;
/// A fit within this many times the noise is not tried again from samples. Well below one: what
/// follows a near object instead of walls far away leaves little in the inverse range of the walls.
const RESTART_SCALE: f64 = 0.5;
/// A second fit replaces the first where its residual is smaller by this factor.
const RESTART_GAIN: f64 = 0.7;
/// With 30 % of the domains wrong, one of so many samples of so many rows is free of them with a
/// probability of 99 %.
const SAMPLES: usize = 60;
const SAMPLE_ROWS: usize = 7;
/// A sample determines less than all domains do.
const SAMPLE_SCORE: f64 = 0.1;

/// What is known of the motion apart from the images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Prior {
    /// Taken by directions that nothing determines: `[omega, v]`, radians and metres.
    pub(crate) motion: Vector6<f64>,
    /// Inverse covariance of what is known, and its product with the motion known.
    pub(crate) information: Matrix6<f64>,
    pub(crate) gradient: Vector6<f64>,
}

impl Prior {
    /// Nothing known: the directions that the images do not determine take the value zero.
    pub(crate) fn none() -> Self {
        Self {
            motion: Vector6::zeros(),
            information: Matrix6::zeros(),
            gradient: Vector6::zeros(),
        }
    }
}

/// What the solve gives.
#[derive(Clone, Debug)]
pub(crate) struct Solution {
    pub(crate) twist: Vector6<f64>,
    /// What the domains let see through the noise.
    pub(crate) spectrum: Spectrum,
    /// Which directions were estimated.
    pub(crate) cut: Cut,
    /// Weighted normal matrix, with the prior's part.
    pub(crate) normal: Matrix6<f64>,
    /// Variance of a residual, weighted: the normal matrix over it is the information.
    pub(crate) variance: f64,
    /// Share of the domains that the robust weights reject.
    pub(crate) rejected_share: f64,
    /// Robust residual in units of the expected noise.
    pub(crate) scale: f64,
    /// The same of a camera at rest: what there was to explain.
    pub(crate) scale_at_rest: f64,
    pub(crate) domains: usize,
    /// Mean range of the scene, metres.
    pub(crate) mean_range_m: f64,
}

/// One solve of the normal equations.
struct Step {
    twist: Vector6<f64>,
    spectrum: Spectrum,
    cut: Cut,
    normal: Matrix6<f64>,
    /// With which the prior was scaled.
    sigma: f64,
}

/// Room for the rows and residuals, kept between calls.
#[derive(Clone, Debug, Default)]
pub(crate) struct RobustSolver {
    rows: Vec<Row>,
    sorted: Vec<f64>,
    mean_range_m: f64,
}

impl RobustSolver {
    /// A part that moves otherwise than the solution, in the rows taken last.
    pub(crate) fn second_motion(
        &mut self,
        config: &Config,
        solution: &Solution,
        moved_m: f64,
    ) -> SecondMotion {
        let found = Found {
            twist: solution.twist,
            sigma: solution.scale * config.domain_noise,
            moved_m,
            range_m: self.mean_range_m,
        };
        second_motion::find(config, &self.rows, &found, &mut self.sorted)
    }

    /// Takes the usable domains; returns how many there are. Every domain weighs the same per
    /// domain mean: the noise of depth cameras is correlated, so that a larger mean is hardly
    /// better than a smaller one. Where the noise depends on the distance, rows are divided by its
    /// share of [`Config::domain_noise`], which stays the unit of all residuals.
    pub(crate) fn take(&mut self, sums: &[CellSums], tiling: &Tiling, config: &Config) -> usize {
        self.rows.clear();
        let (mut range, share) = (0.0, config.domain_known_share);
        for (cell, &full) in sums.iter().zip(&tiling.full) {
            if cell.count == 0 || f64::from(cell.count) < share * f64::from(full) {
                continue;
            }
            let noise = config
                .noise
                .relative(cell.gamma / cell.area, config.domain_noise);
            let per_area = 1.0 / (cell.area * noise);
            range += cell.area / cell.gamma;
            self.rows.push(Row {
                change: cell.change * per_area,
                coefficients: Vector6::from(cell.coefficients) * per_area,
            });
        }
        self.mean_range_m = range / self.rows.len().max(1) as f64;
        self.rows.len()
    }

    /// The motion from nothing: least squares reweighted with Cauchy's weights, and again from the
    /// best of a few small samples where that leaves more than noise, as a large moving object
    /// drags plain least squares into a wrong minimum. Directions that the domains do not determine
    /// take their value from `prior`.
    pub(crate) fn solve(&mut self, config: &Config, prior: &Prior) -> Solution {
        let noise = config.domain_noise;
        let start = self.weighted(config, prior, noise, |_| (1.0, 1.0)).twist;
        let found = self.solve_from(config, prior, start);
        if found.scale <= RESTART_SCALE {
            return found;
        }
        let start = self.best_sample(config, prior);
        let other = self.solve_from(config, prior, start);
        if other.scale < RESTART_GAIN * found.scale {
            other
        } else {
            found
        }
    }

    /// Iteratively reweighted least squares from a first guess.
    pub(crate) fn solve_from(
        &mut self,
        config: &Config,
        prior: &Prior,
        start: Vector6<f64>,
    ) -> Solution {
        let noise = config.domain_noise;
        let mut twist = start;
        let mut step = None;
        let still_m = CLEAN_STEP * noise * self.mean_range_m * self.mean_range_m;
        let mut moved_m = f64::INFINITY;
        for sweep in 0..config.sweeps + CLEAN_SWEEPS {
            let scale = self.scale(&twist).max(SMALLEST_SCALE * noise);
            let clean = scale < CLEAN_SCALE * noise && moved_m > still_m;
            if sweep >= config.sweeps && (config.sweeps == 0 || !clean) {
                break;
            }
            let previous = twist;
            // What is observable is judged at the level of the noise: on data without noise the
            // scale is tiny, and a few domains that happen to fit exactly would seem to be all.
            let found = self.weighted(config, prior, scale.max(noise), |row| {
                let blunt = cauchy(row, &previous, scale.max(noise));
                (cauchy(row, &previous, scale) + LEAST_SHARE * blunt, blunt)
            });
            twist = found.twist;
            moved_m = size_m(&(twist - previous), self.mean_range_m);
            step = Some(found);
        }
        let step = step.unwrap_or_else(|| self.weighted(config, prior, noise, |_| (1.0, 1.0)));
        let sigma = self.scale(&twist);
        let scale = sigma.max(SMALLEST_SCALE * noise);
        let (mut squares, mut rejected) = (0.0, 0);
        for row in &self.rows {
            let weight = cauchy(row, &twist, scale);
            squares += weight * row.residual(&twist).powi(2);
            rejected += usize::from(cauchy(row, &twist, scale.max(noise)) < REJECTED);
        }
        let freedom = self.rows.len().saturating_sub(6).max(1) as f64;
        let variance = (squares / freedom).max((SMALLEST_SCALE * noise).powi(2));
        Solution {
            twist,
            spectrum: step.spectrum,
            cut: step.cut,
            // The prior's part over this variance must be the prior's own information.
            normal: step.normal + prior.information * (variance - step.sigma * step.sigma),
            variance,
            rejected_share: f64::from(rejected as u32) / self.rows.len().max(1) as f64,
            scale: sigma / noise,
            scale_at_rest: self.scale(&Vector6::zeros()) / noise,
            domains: self.rows.len(),
            mean_range_m: self.mean_range_m,
        }
    }

    /// The twist of the small sample that leaves the smallest median residual (least median of
    /// squares, Rousseeuw 1984). The samples are the same in every run.
    fn best_sample(&mut self, config: &Config, prior: &Prior) -> Vector6<f64> {
        let mut best = (f64::INFINITY, prior.motion);
        let mut state = 1_u64;
        for _ in 0..SAMPLES {
            let mut normal = Matrix6::zeros();
            let mut right = Vector6::zeros();
            for _ in 0..SAMPLE_ROWS {
                // Knuth's MMIX generator; its upper half is good enough to pick rows
                state = state
                    .wrapping_mul(6364136223846793005)
                    .wrapping_add(1442695040888963407);
                let row = &self.rows[(state >> 33) as usize % self.rows.len()];
                normal += row.coefficients * row.coefficients.transpose();
                right += row.coefficients * row.change;
            }
            let spectrum = Spectrum::new(&normal, self.mean_range_m);
            let cut = Cut {
                score: SAMPLE_SCORE * config.unobservable_score,
                eigenvalue: 0.0,
            };
            let twist = spectrum.solve(&normal, &right, cut, &prior.motion);
            let scale = self.scale(&twist);
            if scale < best.0 {
                best = (scale, twist);
            }
        }
        best.1
    }

    /// One solve; `weights` of a row: in the equations, and in the judgement of what is observable.
    /// `sigma` is the standard deviation of a residual, which scales the prior's information.
    fn weighted(
        &self,
        config: &Config,
        prior: &Prior,
        sigma: f64,
        weights: impl Fn(&Row) -> (f64, f64),
    ) -> Step {
        let known = prior.information * (sigma * sigma);
        let (mut normal, mut seen) = (known, Matrix6::zeros());
        let mut right = prior.gradient * (sigma * sigma);
        for row in &self.rows {
            let (sharp, blunt) = weights(row);
            let square = row.coefficients * row.coefficients.transpose();
            normal += square * sharp;
            seen += square * blunt;
            right += row.coefficients * (sharp * row.change);
        }
        let spectrum = if known == Matrix6::zeros() {
            Spectrum::new(&seen, self.mean_range_m)
        } else {
            Spectrum::with_prior(&(seen + known), &seen, self.mean_range_m)
        };
        let cut = Cut {
            score: config.unobservable_score,
            eigenvalue: (sigma / config.max_std_m).powi(2),
        };
        Step {
            twist: spectrum.solve(&normal, &right, cut, &prior.motion),
            spectrum,
            cut,
            normal,
            sigma,
        }
    }

    /// Robust standard deviation of the residuals.
    fn scale(&mut self, twist: &Vector6<f64>) -> f64 {
        self.sorted.clear();
        self.sorted
            .extend(self.rows.iter().map(|row| row.residual(twist)));
        mad_sigma_mut(&mut self.sorted).unwrap_or(0.0)
    }
}

fn cauchy(row: &Row, twist: &Vector6<f64>, scale: f64) -> f64 {
    let ratio = row.residual(twist) / (CAUCHY * scale);
    1.0 / (1.0 + ratio * ratio)
}
