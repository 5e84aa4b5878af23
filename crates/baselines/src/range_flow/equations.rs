//! The robust solution of the blocks' equations for one motion.

use super::RangeFlowConfig;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use rayon::prelude::*;
use sphereflow_alignment::observability::{Cut, Spectrum};
use sphereflow_core::statistics::{SIGMA_PER_MAD, median_mut};

/// Cauchy's constant in units of the median absolute residual's sigma: 95 % efficiency.
const CAUCHY: f64 = 2.385;
/// Exact data must not turn rounding errors into outliers: smallest scale in units of the noise.
const SMALLEST_SCALE: f64 = 1e-3;
/// Rows summed at once; the chunks are fixed, so that the sums do not depend on the threads.
const CHUNK: usize = 2048;
/// The mean of two images has half the deviation of their difference, and a gradient is the
/// difference of two of its values: its variance is so much of that of a residual, over the span
/// squared, were the noise of neighbours independent.
const GRADIENT_VARIANCE: f64 = 0.5;

/// One block: `change = coefficients . [omega, v] dt`, inverse range, 1/m.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    coefficients: [f32; 6],
    change: f32,
    ray: [f32; 3],
    gamma: f32,
    /// 1 / squared angle of the differences that gave the gradient.
    per_span: f32,
}

impl Row {
    /// `None` where a number is not finite.
    pub(super) fn new(
        ray: &Vector3<f32>,
        plane: &Vector3<f32>,
        gamma: f32,
        change: f32,
        per_span: f32,
    ) -> Option<Self> {
        let (turning, moving) = (ray.cross(plane), plane * gamma);
        let all = turning.sum() + moving.sum() + change + per_span;
        all.is_finite().then_some(Self {
            coefficients: [
                turning.x, turning.y, turning.z, moving.x, moving.y, moving.z,
            ],
            change,
            ray: [ray.x, ray.y, ray.z],
            gamma,
            per_span,
        })
    }

    fn residual(&self, motion: &Vector6<f64>) -> f64 {
        let products = self.coefficients.iter().zip(motion.iter());
        f64::from(self.change) - products.map(|(c, x)| f64::from(*c) * x).sum::<f64>()
    }

    /// What noise of unit variance adds to the square of the coefficients: `J P J^T` with P the
    /// projection across the ray and `J = [[eta]x; gamma]`.
    fn noise_square(&self) -> Matrix6<f64> {
        let ray = Vector3::from(self.ray.map(f64::from));
        let gamma = f64::from(self.gamma);
        let across = Matrix3::identity() - ray * ray.transpose();
        let mixed = ray.cross_matrix() * gamma;
        let mut square = Matrix6::zeros();
        square.fixed_view_mut::<3, 3>(0, 0).copy_from(&across);
        square.fixed_view_mut::<3, 3>(0, 3).copy_from(&mixed);
        square
            .fixed_view_mut::<3, 3>(3, 0)
            .copy_from(&mixed.transpose());
        square
            .fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&(across * (gamma * gamma)));
        square * f64::from(self.per_span)
    }
}

/// What the solve of one level gives, displacements over the interval.
#[derive(Clone, Debug)]
pub(super) struct Solution {
    /// `[omega, v] dt`.
    pub(super) motion: Vector6<f64>,
    /// What the blocks let see once the gradients' own noise is taken off.
    pub(super) spectrum: Spectrum,
    pub(super) normal: Matrix6<f64>,
    /// Variance of a residual, weighted.
    pub(super) variance: f64,
    /// Robust residual, 1/m.
    pub(super) scale: f64,
    pub(super) blocks: usize,
    pub(super) mean_range_m: f64,
}

/// Sums over a chunk of rows: upper triangle of the normal matrix, right-hand side, squares.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    normal: [f64; 21],
    right: [f64; 6],
    squares: f64,
}

/// Room for the rows and residuals, kept between calls.
#[derive(Clone, Debug, Default)]
pub(super) struct Equations {
    pub(super) rows: Vec<Row>,
    sorted: Vec<f32>,
    partial: Vec<Sums>,
}

impl Equations {
    /// Least squares reweighted with Cauchy's weights, from plain least squares or, of a pair that
    /// was warped, from rest. What is not observable stays at rest.
    pub(super) fn solve(&mut self, config: &RangeFlowConfig, from_rest: bool) -> Solution {
        let range = self.rows.iter().map(|row| 1.0 / f64::from(row.gamma));
        let mean_range_m = range.sum::<f64>() / self.rows.len().max(1) as f64;
        let smallest = SMALLEST_SCALE * config.block_noise;
        let rest = Vector6::zeros();
        let mut motion = rest;
        if !from_rest {
            let (normal, right, _) = self.sums(&rest, f64::INFINITY);
            motion = solved(&normal, &right, mean_range_m);
        }
        let mut scale = self.scale(&motion).max(smallest);
        for _ in 0..config.sweeps {
            let (normal, right, _) = self.sums(&motion, scale);
            motion = solved(&normal, &right, mean_range_m);
            scale = self.scale(&motion).max(smallest);
        }
        let (normal, right, squares) = self.sums(&motion, scale);
        let seen = normal - self.gradient_noise(&motion, scale);
        let spectrum = Spectrum::new(&seen, mean_range_m);
        motion = spectrum.solve(
            &normal,
            &right,
            Cut::of_score(config.unobservable_score),
            &rest,
        );
        let freedom = self.rows.len().saturating_sub(6).max(1) as f64;
        Solution {
            motion,
            spectrum,
            normal,
            variance: (squares / freedom).max(smallest * smallest),
            scale: self.scale(&motion),
            blocks: self.rows.len(),
            mean_range_m,
        }
    }

    /// Robust standard deviation of the residuals.
    pub(super) fn scale(&mut self, motion: &Vector6<f64>) -> f64 {
        self.sorted.clear();
        let residuals = self.rows.iter().map(|row| row.residual(motion).abs());
        self.sorted.extend(residuals.map(|r| r as f32));
        median_mut(&mut self.sorted).map_or(0.0, |median| SIGMA_PER_MAD * f64::from(median))
    }

    /// Weighted normal matrix, right-hand side and sum of squares, with the weights that `motion`
    /// gives.
    fn sums(&mut self, motion: &Vector6<f64>, scale: f64) -> (Matrix6<f64>, Vector6<f64>, f64) {
        self.rows
            .par_chunks(CHUNK)
            .map(|rows| Sums::of(rows, motion, scale))
            .collect_into_vec(&mut self.partial);
        let mut total = Sums::default();
        for part in &self.partial {
            total.add(part);
        }
        let mut normal = Matrix6::zeros();
        let mut values = total.normal.iter();
        for i in 0..6 {
            for (j, &value) in (i..6).zip(values.by_ref()) {
                normal[(i, j)] = value;
                normal[(j, i)] = value;
            }
        }
        (normal, total.right.into(), total.squares)
    }

    /// What the noise of the gradients adds to the normal matrix: a wall seen with noise has
    /// gradients along itself, which are none of the wall's.
    fn gradient_noise(&self, motion: &Vector6<f64>, scale: f64) -> Matrix6<f64> {
        let squares = self.rows.iter();
        let sum = squares.fold(Matrix6::zeros(), |sum, row| {
            sum + row.noise_square() * cauchy(row.residual(motion), scale)
        });
        sum * (GRADIENT_VARIANCE * scale * scale)
    }
}

impl Sums {
    fn of(rows: &[Row], motion: &Vector6<f64>, scale: f64) -> Self {
        let mut sums = Self::default();
        for row in rows {
            let residual = row.residual(motion);
            let weight = cauchy(residual, scale);
            let c = row.coefficients.map(f64::from);
            let mut k = 0;
            for i in 0..6 {
                let weighted = weight * c[i];
                for value in &c[i..] {
                    sums.normal[k] += weighted * value;
                    k += 1;
                }
                sums.right[i] += weighted * f64::from(row.change);
            }
            sums.squares += weight * residual * residual;
        }
        sums
    }

    fn add(&mut self, other: &Self) {
        for (a, b) in self.normal.iter_mut().zip(&other.normal) {
            *a += b;
        }
        for (a, b) in self.right.iter_mut().zip(&other.right) {
            *a += b;
        }
        self.squares += other.squares;
    }
}

/// Solves with nothing left out but what is not there at all.
fn solved(normal: &Matrix6<f64>, right: &Vector6<f64>, mean_range_m: f64) -> Vector6<f64> {
    /// Rounding of the coefficients.
    const SMALLEST_SCORE: f64 = 1e-4;
    Spectrum::new(normal, mean_range_m).solve(
        normal,
        right,
        Cut::of_score(SMALLEST_SCORE),
        &Vector6::zeros(),
    )
}

fn cauchy(residual: f64, scale: f64) -> f64 {
    let ratio = residual / (CAUCHY * scale);
    1.0 / (1.0 + ratio * ratio)
}
