//! Information without the part that noise only pretends.
//!
//! Sensitivities are slopes of noisy images, and `sum w s s'` grows with their noise: before a plain
//! wall it says that a shift along the wall is known to millimetres. Two sensitivities of the same
//! pixel whose noise is independent, `a` from the image and `b` from its reference, have
//! `E[sum w a b'] =` the information without noise; what is missing to `sum w a a'` is noise's share.
//! The estimate's normal equations `z = sum w a r` are then a measurement `z = D x + e` of the motion
//! x with `D = sum w (a b' + b a') / 2` and `cov e = A = sum w a a'`: their information is
//! `D A^-1 D`, and nothing where D is not above its own noise.

use nalgebra::{Matrix6, Vector6};

/// Square root of the smallest to the largest eigenvalue, rates scaled by the mean range, below which
/// a direction is blind: as the odometry's `information` has it. The errors of sampling and of slopes
/// by differences are of this size. Lower: they count as information; higher: far ends of corridors
/// are not used.
pub const BLIND_SCORE: f64 = 0.01;
/// Share of `D` in `A` along a direction below which it is blind, of one pair. Slopes of 160x120 pixels,
/// smoothed over 25, have some 760 independent values: pure noise has shares of 0 +- 0.04, the largest
/// of six directions 0.1. Lower: noise is taken for information now and then; higher: so are faint
/// textures for noise.
pub const LEAST_OF_PAIR: f64 = 0.2;
/// The same of the sums of a second: noise averages out, and 0.01 is left. Lower and higher as above.
const LEAST_OF_SECOND: f64 = 0.05;
/// More than that by this over the number of pairs: the first ones stand alone.
const LEAST_AT_FIRST: f64 = 0.3;
/// Time constant of those sums, seconds. Shorter: more noise; longer: what is new is seen later.
pub const SUMS_TAU_S: f64 = 1.0;

/// The two sums of a pair of images, and what they say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sums {
    /// `A = sum w a a'`.
    pub naive: Matrix6<f64>,
    /// `D = sum w (a b' + b a') / 2`.
    pub cross: Matrix6<f64>,
    /// How many pairs are in it.
    pairs: usize,
}

/// The spectrum of `D` relative to `A`.
#[derive(Clone, Copy, Debug)]
pub struct Spectrum {
    scale: Matrix6<f64>,
    unscale: Matrix6<f64>,
    factor: Matrix6<f64>,
    inverse_factor: Matrix6<f64>,
    vectors: Matrix6<f64>,
    shares: Vector6<f64>,
}

impl Sums {
    /// Nothing yet.
    pub fn zeros() -> Self {
        Self {
            naive: Matrix6::zeros(),
            cross: Matrix6::zeros(),
            pairs: 0,
        }
    }

    /// A pixel's two sensitivities with its weight.
    #[inline]
    pub fn push(&mut self, a: &Vector6<f64>, b: &Vector6<f64>, weight: f64) {
        let both = a * b.transpose();
        self.naive += a * a.transpose() * weight;
        self.cross += (both + both.transpose()) * (0.5 * weight);
    }

    /// Both sums of two parts.
    pub fn add(&mut self, other: &Self, weight: f64) {
        self.naive += other.naive * weight;
        self.cross += other.cross * weight;
    }

    /// Those of the last second or so, `dt_s` later.
    pub fn follow(&mut self, now: &Self, dt_s: f64) {
        let share = 1.0 - (-dt_s / SUMS_TAU_S).exp();
        let mut next = Self::zeros();
        next.add(self, 1.0 - share);
        next.add(now, share);
        next.pairs = self.pairs + 1;
        *self = next;
    }

    /// What is left of the information of a second's sums, as [`Sums::spectrum`] has it.
    pub fn gathered(&self, mean_range: f64) -> Option<Spectrum> {
        let at_first = LEAST_AT_FIRST / self.pairs.max(1) as f64;
        self.spectrum(mean_range, LEAST_OF_SECOND + at_first)
    }

    /// What is left of the information, of directions with this `least` share: `None` where
    /// nothing is. Order [angular, linear]; `mean_range`
    /// makes rates comparable to velocities.
    pub fn spectrum(&self, mean_range: f64, least: f64) -> Option<Spectrum> {
        let l = mean_range.max(f64::MIN_POSITIVE);
        let diagonal = |l: f64| Matrix6::from_diagonal(&Vector6::new(l, l, l, 1.0, 1.0, 1.0));
        let (scale, unscale) = (diagonal(1.0 / l), diagonal(l));
        let cross = scale * self.cross * scale;
        let largest = cross.symmetric_eigenvalues().max();
        if !(largest > 0.0 && largest.is_finite()) {
            return None;
        }
        let floor = Matrix6::identity() * (BLIND_SCORE * BLIND_SCORE * largest);
        let factor = (scale * self.naive * scale + floor).cholesky()?.l();
        let inverse_factor = factor.try_inverse()?;
        let eigen = (inverse_factor * cross * inverse_factor.transpose()).symmetric_eigen();
        let shares = eigen.eigenvalues.map(|share| {
            let seen = share >= least;
            if seen { share.min(1.0) } else { 0.0 }
        });
        Some(Spectrum {
            scale,
            unscale,
            factor,
            inverse_factor,
            vectors: eigen.eigenvectors,
            shares,
        })
    }
}

impl Spectrum {
    /// `D A^-1 D` over the directions that are seen.
    pub fn information(&self) -> Matrix6<f64> {
        let half = self.unscale * self.factor * self.vectors;
        let squares = Matrix6::from_diagonal(&self.shares.map(|s| s * s));
        let found = half * squares * half.transpose();
        (found + found.transpose()) * 0.5
    }

    /// The sums of a pair without what is not seen here.
    pub fn within(&self, sums: &Sums) -> Sums {
        let kept = Matrix6::from_diagonal(&self.shares.map(|s| f64::from(u8::from(s > 0.0))));
        let half = self.unscale * self.factor * self.vectors * kept;
        let project = half * self.vectors.transpose() * self.inverse_factor * self.scale;
        Sums {
            naive: sums.naive,
            cross: project * sums.cross * project.transpose(),
            pairs: sums.pairs,
        }
    }

    /// `D A^-1 z`: the gradient that goes with it.
    pub fn gradient(&self, naive: &Vector6<f64>) -> Vector6<f64> {
        let inner = self.vectors.transpose() * self.inverse_factor * self.scale * naive;
        self.unscale * self.factor * self.vectors * self.shares.component_mul(&inner)
    }

    /// `G^-1 right` for another matrix G of the same kind, over the directions that are seen.
    pub fn solved(&self, gram: &Matrix6<f64>, right: &Vector6<f64>) -> Vector6<f64> {
        let mut basis = self.scale * self.inverse_factor.transpose() * self.vectors;
        let mut unseen = Matrix6::zeros();
        for i in 0..6 {
            if self.shares[i] <= 0.0 {
                basis.column_mut(i).fill(0.0);
                unseen[(i, i)] = 1.0;
            }
        }
        let inner = basis.transpose() * gram * basis + unseen;
        let solved = inner
            .cholesky()
            .map(|f| f.solve(&(basis.transpose() * right)));
        solved.map_or_else(Vector6::zeros, |x| basis * x)
    }
}

/// Directions [angular, linear] without information, of unit length with rates scaled by the mean
/// range. Where no linear velocity is asked for, the angular part alone.
pub fn blind_directions(
    information: &Matrix6<f64>,
    mean_range: f64,
    linear: bool,
) -> Vec<Vector6<f64>> {
    let l = mean_range;
    let scale = Matrix6::from_diagonal(&Vector6::new(1.0 / l, 1.0 / l, 1.0 / l, 1.0, 1.0, 1.0));
    let mut form = scale * information * scale;
    if !linear {
        for i in 3..6 {
            form.row_mut(i).fill(0.0);
            form.column_mut(i).fill(0.0);
            form[(i, i)] = form[(0, 0)].max(form[(1, 1)]).max(form[(2, 2)]);
        }
    }
    let eigen = form.symmetric_eigen();
    let largest = eigen.eigenvalues.max();
    (0..6)
        .filter(|i| eigen.eigenvalues[*i] <= BLIND_SCORE * BLIND_SCORE * largest)
        .map(|i| eigen.eigenvectors.column(i).into_owned())
        .collect()
}
