//! The unified model of catadioptric cameras: a sphere, seen from a point on its axis.

use super::Bend;
use nalgebra::{Matrix2x3, RowVector3, Vector2, Vector3};
use sphereflow_core::{Error, Result};

/// Rounding of a ray at the border of the model, relative to its length.
const BORDER: f64 = 1e-14;

/// `m = (x, y) / (alpha |X| + (1 - alpha) z)`, alpha in [0, 1]: 0 is the pinhole, 1/2 the
/// paracatadioptric camera (Geyer and Daniilidis 2000, Mei and Rives 2007; this parametrisation and
/// its domain from Usenko, Demmel and Cremers 2018, "The Double Sphere Camera Model").
///
/// Thesis: section 1.1.1 (central catadioptric cameras).
///
/// Seen is `z > -w |X|` with `w = alpha / (1 - alpha)` up to alpha = 1/2, `(1 - alpha) / alpha`
/// above; there the image is the disc `|m|^2 <= 1 / (2 alpha - 1)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unified {
    alpha: f64,
}

impl Unified {
    /// # Errors
    /// [`Error::Value`] naming `alpha` where it is not in [0, 1].
    pub fn new(alpha: f64) -> Result<Self> {
        if !(0.0..=1.0).contains(&alpha) {
            return Err(Error::value("alpha", "a number from 0 to 1", alpha));
        }
        Ok(Self { alpha })
    }

    /// The weight of the sphere.
    pub fn alpha(&self) -> f64 {
        self.alpha
    }

    /// The denominator `alpha |X| + (1 - alpha) z`, where the point is seen.
    fn denominator(&self, point: &Vector3<f64>) -> Option<f64> {
        let (alpha, distance) = (self.alpha, point.norm());
        let seen = if alpha > 0.5 {
            point.z > -((1.0 - alpha) / alpha + BORDER) * distance
        } else {
            true // the denominator is positive exactly where the point is seen
        };
        let denominator = alpha * distance + (1.0 - alpha) * point.z;
        (seen && denominator > 0.0).then_some(denominator)
    }

    /// The third coordinate of the direction whose first two are `m`.
    pub(crate) fn lift(&self, m: &Vector2<f64>) -> Option<f64> {
        let (alpha, r2) = (self.alpha, m.norm_squared());
        let under = 1.0 - (2.0 * alpha - 1.0) * r2;
        let denominator = alpha * under.sqrt() + 1.0 - alpha;
        let lifted = (1.0 - alpha * alpha * r2) / denominator;
        (under >= 0.0 && lifted.is_finite()).then_some(lifted)
    }
}

impl Bend for Unified {
    fn bend(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        let denominator = self.denominator(point)?;
        Some(Vector2::new(point.x, point.y) / denominator)
    }

    fn bend_with_jacobian(&self, point: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        let denominator = self.denominator(point)?;
        let m = Vector2::new(point.x, point.y) / denominator;
        let mut by_point: RowVector3<f64> = point.transpose() * (self.alpha / point.norm());
        by_point.z += 1.0 - self.alpha;
        let numerator = Matrix2x3::identity();
        Some((m, (numerator - m * by_point) / denominator))
    }

    fn straighten(&self, m: &Vector2<f64>) -> Option<Vector3<f64>> {
        Some(Vector3::new(m.x, m.y, self.lift(m)?).normalize())
    }

    fn named(&self) -> Vec<(&'static str, f64)> {
        vec![("alpha", self.alpha)]
    }
}
