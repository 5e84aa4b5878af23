//! One domain's balance as a row of the equations.

use nalgebra::Vector6;

/// One domain: `change = coefficients . [omega, v]` of a small motion `[omega, v]` between the
/// images (radians and metres), per unit of solid angle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    pub(crate) change: f64,
    pub(crate) coefficients: Vector6<f64>,
}

impl Row {
    /// What `twist` leaves.
    pub(crate) fn residual(&self, twist: &Vector6<f64>) -> f64 {
        self.change - self.coefficients.dot(twist)
    }
}
