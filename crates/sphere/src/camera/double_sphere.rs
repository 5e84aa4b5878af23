//! The double sphere model of wide lenses: two spheres, one after the other.

use super::{Bend, Unified};
use nalgebra::{Matrix2x3, Matrix3, Vector2, Vector3};
use sphereflow_core::{Error, Result};

/// Names of the parameters.
pub(crate) const NAMES: [&str; 2] = ["xi", "alpha"];

/// The unified model of the point `(x, y, z + xi |X|)` (Usenko, Demmel and Cremers 2018, "The
/// Double Sphere Camera Model"): `m = (x, y) / (alpha d2 + (1 - alpha)(z + xi d1))` with `d1 = |X|`,
/// `d2 = |(x, y, z + xi d1)|`.
///
/// Seen is what the unified model sees of the shifted point: there the image is one to one, and is
/// the image that has rays. With `w1` of the unified model that is `z > -w d1`, where
/// `w = xi - w1^2 xi + w1 sqrt(1 - xi^2 + w1^2 xi^2)`. The paper prints
/// `w2 = (w1 + xi) / sqrt(2 w1 xi + xi^2 + 1)` instead, which is slightly smaller for its lenses
/// but lets folded points in where `w1` is small and `xi` negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DoubleSphere {
    xi: f64,
    second: Unified,
}

impl DoubleSphere {
    /// # Errors
    /// [`Error::Value`] naming `xi` where it is not between -1 and 1, `alpha` where it is not in
    /// [0, 1].
    pub fn new(xi: f64, alpha: f64) -> Result<Self> {
        if !(xi > -1.0 && xi < 1.0) {
            return Err(Error::value("xi", "a number between -1 and 1", xi));
        }
        Ok(Self {
            xi,
            second: Unified::new(alpha)?,
        })
    }

    /// The shift between the two spheres.
    pub fn xi(&self) -> f64 {
        self.xi
    }

    /// The weight of the second sphere.
    pub fn alpha(&self) -> f64 {
        self.second.alpha()
    }

    fn shift(&self, point: &Vector3<f64>) -> Vector3<f64> {
        Vector3::new(point.x, point.y, point.z + self.xi * point.norm())
    }
}

impl Bend for DoubleSphere {
    fn bend(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        self.second.bend(&self.shift(point))
    }

    fn bend_with_jacobian(&self, point: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        let (m, m_by_shifted) = self.second.bend_with_jacobian(&self.shift(point))?;
        let mut shifted_by_point = Matrix3::identity();
        let tilt = point.transpose() * (self.xi / point.norm());
        shifted_by_point.set_row(2, &(shifted_by_point.row(2) + tilt));
        Some((m, m_by_shifted * shifted_by_point))
    }

    fn straighten(&self, m: &Vector2<f64>) -> Option<Vector3<f64>> {
        let lifted = self.second.lift(m)?;
        let r2 = m.norm_squared();
        let xi = self.xi;
        let root = (lifted * lifted + (1.0 - xi * xi) * r2).sqrt();
        let scale = (lifted * xi + root) / (lifted * lifted + r2);
        let ray = Vector3::new(scale * m.x, scale * m.y, scale * lifted - xi);
        ray.iter().all(|v| v.is_finite()).then(|| ray.normalize())
    }

    fn named(&self) -> Vec<(&'static str, f64)> {
        NAMES.into_iter().zip([self.xi, self.alpha()]).collect()
    }
}
