//! Whether the scene moves as one: a second rigid motion sought among the domains.
//!
//! A person who fills half the view may win the robust solve: the motion found is then the person's,
//! and what the walls leave is small in the inverse range, so that no single domain stands out. But
//! together they move otherwise. Expectation maximisation with two motions says how many domains
//! follow another one, and how far it is from the one found.

use crate::config::Config;
use crate::rows::Row;
use nalgebra::{Matrix6, Vector6};
use sphereflow_core::statistics::mad_sigma_mut;

/// Rounds of assignment and solve.
const ROUNDS: usize = 6;
/// Cauchy's constant in units of sigma.
const CAUCHY: f64 = 2.385;
/// The second motion is initialised from the domains that the first rejects, except those with
/// residuals far beyond this, in units of sigma, which come from the borders of objects.
const WILD: f64 = 10.0;
/// A domain follows the second motion where its squared residual, in units of sigma, is smaller by
/// this much than with the first, and no outlier of it.
const CLEAR: f64 = 4.0;
const OUTLIER: f64 = 9.0;
/// Share of the best determined direction below which a motion of a part keeps to the one found.
const RIDGE: f64 = 1e-4;
/// Squared distance of the two motions in units of its covariance from which they are two.
const SURPRISE: f64 = 8.0;

/// A second rigid motion, of a part of the domains.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SecondMotion {
    /// Share of all domains that clearly follow it rather than the one found; 0 where there is none
    /// that noise and distortion would not feign.
    pub share: f64,
    /// The step that leads to it: `[omega, v]`, radians and metres.
    pub step: Vector6<f64>,
}

/// What was found, and at which accuracy that is meant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found {
    /// The last step.
    pub(crate) twist: Vector6<f64>,
    /// Robust standard deviation of the residuals.
    pub(crate) sigma: f64,
    /// The whole motion, of which the distortion of the depth takes its share.
    pub(crate) moved_m: f64,
    pub(crate) range_m: f64,
}

/// Looks for a second motion; `sorted` is working memory.
pub(crate) fn find(
    config: &Config,
    rows: &[Row],
    found: &Found,
    sorted: &mut Vec<f64>,
) -> SecondMotion {
    let mut pair = TwoMotions {
        motions: [found.twist; 2],
        sigma: found.sigma.max(config.domain_noise),
        normals: [Matrix6::zeros(); 2],
    };
    for round in 0..ROUNDS {
        pair.solve(rows, found, round == 0);
        if round > 0 {
            pair.sigma = config.domain_noise.max(pair.scale(rows, sorted));
        }
    }
    let followers = rows.iter().filter(|row| pair.follows_second(row)).count();
    if pair.surprise(config, found) < SURPRISE {
        return SecondMotion::default();
    }
    SecondMotion {
        share: followers as f64 / rows.len() as f64,
        step: pair.motions[1] - found.twist,
    }
}

struct TwoMotions {
    motions: [Vector6<f64>; 2],
    sigma: f64,
    /// In the coordinates `[L omega, v]`.
    normals: [Matrix6<f64>; 2],
}

impl TwoMotions {
    /// One round: every domain is shared out by how well both motions suit it, then both are solved.
    fn solve(&mut self, rows: &[Row], found: &Found, first_round: bool) {
        self.normals = [Matrix6::zeros(); 2];
        let mut rights = [Vector6::zeros(); 2];
        for row in rows {
            let weights = if first_round {
                self.first_weights(row)
            } else {
                self.weights(row)
            };
            let c = scaled(&row.coefficients, 1.0 / found.range_m);
            let square = c * c.transpose();
            for (k, weight) in weights.into_iter().enumerate() {
                self.normals[k] += square * weight;
                rights[k] += c * (weight * row.change);
            }
        }
        let here = scaled(&found.twist, found.range_m);
        let parts = self.motions.iter_mut().zip(&self.normals).zip(&rights);
        for ((motion, normal), right) in parts {
            let ridge = RIDGE * normal.trace();
            if let Some(factor) = (normal + Matrix6::identity() * ridge).cholesky() {
                let solved = factor.solve(&(right + here * ridge));
                *motion = scaled(&solved, 1.0 / found.range_m);
            }
        }
    }

    fn first_weights(&self, row: &Row) -> [f64; 2] {
        let r = row.residual(&self.motions[0]) / self.sigma;
        let suits = 1.0 / (1.0 + (r / CAUCHY).powi(2));
        [suits, (1.0 - suits) / (1.0 + (r / WILD).powi(2))]
    }

    fn weights(&self, row: &Row) -> [f64; 2] {
        let [a, b] = self.squares(row);
        let second = 1.0 / (1.0 + ((b - a) / 2.0).clamp(-30.0, 30.0).exp());
        let suits = |square: f64| 1.0 / (1.0 + square / (CAUCHY * CAUCHY));
        [(1.0 - second) * suits(a), second * suits(b)]
    }

    /// Squared residuals in units of sigma.
    fn squares(&self, row: &Row) -> [f64; 2] {
        self.motions
            .map(|motion| (row.residual(&motion) / self.sigma).powi(2))
    }

    fn follows_second(&self, row: &Row) -> bool {
        let [a, b] = self.squares(row);
        a - b > CLEAR && b < OUTLIER
    }

    /// Robust standard deviation of the residuals of whichever motion suits a domain better.
    fn scale(&self, rows: &[Row], sorted: &mut Vec<f64>) -> f64 {
        sorted.clear();
        sorted.extend(rows.iter().map(|row| {
            let [a, b] = self.motions.map(|motion| row.residual(&motion).abs());
            a.min(b)
        }));
        mad_sigma_mut(sorted).unwrap_or(0.0)
    }

    /// Squared distance of the two motions in units of what noise and distortion may make it.
    fn surprise(&self, config: &Config, found: &Found) -> f64 {
        let model = &config.covariance;
        let floor_m = model.floor_m + model.motion_share * found.moved_m;
        let variance = (model.scale * self.sigma).powi(2);
        let mut total = Matrix6::identity() * (2.0 * floor_m * floor_m);
        for normal in &self.normals {
            let ridge = Matrix6::identity() * (RIDGE * normal.trace());
            if let Some(inverse) = (normal + ridge).try_inverse() {
                total += inverse * variance;
            }
        }
        let step = scaled(&(self.motions[1] - self.motions[0]), found.range_m);
        total
            .cholesky()
            .map_or(0.0, |factor| step.dot(&factor.solve(&step)))
    }
}

/// The first three, those of the rotation, multiplied.
fn scaled(vector: &Vector6<f64>, factor: f64) -> Vector6<f64> {
    let mut scaled = *vector;
    for k in 0..3 {
        scaled[k] *= factor;
    }
    scaled
}
