//! What the motion shows of the biases.
//!
//! Thesis: Proposition 7. Gravity and the accelerometer's bias are told apart unless the angular
//! velocity stays along one direction of the body that is orthogonal to the field. Thesis: eq. (7.2): the
//! blind error `e = da_b = dg` has `e x omega = 0` and `e . b = 0` at all times.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};

/// The quadratic form `int |e x omega|^2 + (e . b)^2 dt` of a direction e, gathered over a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Excitation {
    form: Matrix3<f64>,
}

/// A direction with less is blind: a turn at 0.2 rad/s about another axis for one second shows it.
const NEEDED: f64 = 0.04;

impl Excitation {
    /// A step of the motion: debiased rate, rad/s, and the field's unit vector where it is used.
    pub fn push(&mut self, omega: &Vector3<f64>, field: Option<&Vector3<f64>>, dt_s: f64) {
        self.form +=
            (Matrix3::identity() * omega.norm_squared() - omega * omega.transpose()) * dt_s;
        if let Some(field) = field {
            self.form += field * field.transpose() * dt_s;
        }
    }

    /// The directions of the body along which the accelerometer's bias cannot be told from gravity:
    /// orthonormal, none where all is well.
    pub fn blind_directions(&self) -> Vec<Vector3<f64>> {
        let eigen = SymmetricEigen::new(self.form);
        (0..3)
            .filter(|i| eigen.eigenvalues[*i] < NEEDED)
            .map(|i| eigen.eigenvectors.column(i).into_owned())
            .collect()
    }

    /// Number of blind directions, 0 to 3, without their vectors.
    pub fn blind_count(&self) -> usize {
        let eigenvalues = self.form.symmetric_eigenvalues();
        eigenvalues.iter().filter(|v| **v < NEEDED).count()
    }
}
