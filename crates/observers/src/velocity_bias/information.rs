//! Biases as a sum of information over pairs of images, with forgetting.
//!
//! It knows nothing of images: whoever makes rows of a pair (this crate's alignment of pixels, or
//! the weak form of the geometric flow) hands over their normal equations. Order [angular, linear].

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// The normal equations of one pair for the error of the velocities: `information x = gradient`
/// solves for `x = bias - bias_used` with exact velocity readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairInformation {
    /// `sum w s s'`.
    pub information: Matrix6<f64>,
    /// `sum w s r`.
    pub gradient: Vector6<f64>,
    /// The biases that the pair was warped with.
    pub bias_used: Vector6<f64>,
}

/// The accumulated information.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BiasInformation {
    information: Matrix6<f64>,
    vector: Vector6<f64>,
    forget_s: f64,
    noise: Matrix6<f64>,
}

impl BiasInformation {
    /// Nothing known but standard deviations of biases at the start; `linear`, `angular` are the
    /// standard deviations of one velocity reading: the reading's noise is common to all rows of a
    /// pair.
    pub fn new(start: [f64; 2], reading: [f64; 2], forget_s: f64) -> Self {
        let diagonal = |[a, v]: [f64; 2]| Matrix6::from_diagonal(&Vector6::new(a, a, a, v, v, v));
        Self {
            information: diagonal(start.map(|s| 1.0 / (s * s))),
            vector: Vector6::zeros(),
            forget_s,
            noise: diagonal(reading.map(|s| s * s)),
        }
    }

    /// The biases.
    pub fn bias(&self) -> Vector6<f64> {
        self.information
            .cholesky()
            .map_or_else(Vector6::zeros, |c| c.solve(&self.vector))
    }

    /// Their covariance.
    pub fn covariance(&self) -> Option<Matrix6<f64>> {
        self.information.cholesky().map(|c| c.inverse())
    }

    /// Take in a pair, `dt_s` after the one before. `linear` is false where no linear velocity was
    /// measured: the pair's own is then unknown, and only what it leaves of the angular bias counts.
    pub fn push(&mut self, pair: &PairInformation, linear: bool, dt_s: f64) {
        let keep = (-dt_s / self.forget_s).exp();
        self.information *= keep;
        self.vector *= keep;
        if !linear {
            return self.push_angular(pair);
        }
        // (A^-1 + N)^-1 = (1 + A N)^-1 A, defined for every A.
        let Some(inverse) = (Matrix6::identity() + pair.information * self.noise).try_inverse()
        else {
            return;
        };
        let information = inverse * pair.information;
        let information = (information + information.transpose()) * 0.5;
        self.information += information;
        self.vector += information * pair.bias_used + inverse * pair.gradient;
    }

    fn push_angular(&mut self, pair: &PairInformation) {
        let a = &pair.information;
        let block =
            |i: usize, j: usize| -> Matrix3<f64> { a.fixed_view::<3, 3>(i, j).into_owned() };
        let part = |i: usize| -> Vector3<f64> { pair.gradient.fixed_rows::<3>(i).into_owned() };
        let Some(inverse) = block(3, 3).try_inverse() else {
            return;
        };
        let share = block(0, 3) * inverse;
        let schur = block(0, 0) - share * block(3, 0);
        let gradient = part(0) - share * part(3);
        let noise: Matrix3<f64> = self.noise.fixed_view::<3, 3>(0, 0).into_owned();
        let Some(inverse) = (Matrix3::identity() + schur * noise).try_inverse() else {
            return;
        };
        let information = inverse * schur;
        let information = (information + information.transpose()) * 0.5;
        let mut corner = self.information.fixed_view_mut::<3, 3>(0, 0);
        corner += information;
        let used: Vector3<f64> = pair.bias_used.fixed_rows::<3>(0).into_owned();
        let mut head = self.vector.fixed_rows_mut::<3>(0);
        head += information * used + inverse * gradient;
    }
}
