//! What a variational method finds: the inverse range, and how near to the minimum it is.

use sphereflow_core::Plane;

/// Inverse range by a variational method.
#[derive(Clone, Debug, PartialEq)]
pub struct VariationalDepth {
    /// 1/D per metre; NaN where the camera has no ray, or nowhere known where nothing could be seen.
    pub inv_range: Plane<f32>,
    /// The functional at the solution: grey levels squared per second squared (Sobolev), or
    /// per metre (TV-L1), times steradian.
    pub energy: f64,
    /// What is left to gain: the relative residual (Sobolev), or the relative duality gap (TV-L1).
    pub residual: f64,
    /// Iterations used.
    pub iterations: usize,
}

impl VariationalDepth {
    /// Of a pair of images `(width, height)` in which no pixel says anything: all unknown.
    pub(crate) fn silent((width, height): (usize, usize)) -> Self {
        Self {
            inv_range: Plane::filled(width, height, f32::NAN),
            energy: f64::NAN,
            residual: f64::NAN,
            iterations: 0,
        }
    }
}
