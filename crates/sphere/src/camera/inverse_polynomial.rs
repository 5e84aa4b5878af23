//! The thesis's polynomial distortion: undistorted radius as a polynomial of the distorted one.

use super::Bend;
use super::radial::{
    FARTHEST, invert_increasing, polynomial, positive_until, to_radius, to_radius_by_e,
};
use nalgebra::{Matrix2x3, Vector2, Vector3};
use sphereflow_core::{Error, Result};

/// Names of the parameters.
pub(crate) const NAMES: [&str; 6] = ["k1", "k2", "k3", "k4", "dx", "dy"];

/// Thesis: eq. (1.5) with the inverse mapping `r_u = r_d (1 + k1 r_d^2 + k2 r_d^4 + ...)`, about a
/// distortion centre (dx, dy) that may differ from the principal point (image plane coordinates).
///
/// Seen are the radii up to which the polynomial increases.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InversePolynomial {
    k: [f64; 4],
    centre: Vector2<f64>,
    limit: f64,
    /// The image of the limit.
    top: f64,
}

impl InversePolynomial {
    /// From k1..k4 and the distortion centre in image-plane coordinates.
    ///
    /// # Errors
    /// [`Error::Value`] naming the parameter that is not finite.
    pub fn new(k: [f64; 4], centre: [f64; 2]) -> Result<Self> {
        for (name, value) in NAMES.into_iter().zip(k.into_iter().chain(centre)) {
            if !value.is_finite() {
                return Err(Error::value(name, "a finite number", value));
            }
        }
        let [k1, k2, k3, k4] = k;
        let slope = [1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3, 9.0 * k4]; // in the square
        let mut model = Self {
            k,
            centre: centre.into(),
            limit: positive_until(&slope, FARTHEST * FARTHEST).sqrt(),
            top: 0.0,
        };
        model.top = model.undistorted(model.limit).0;
        Ok(model)
    }

    /// The largest distorted radius that has a ray.
    pub fn limit(&self) -> f64 {
        self.limit
    }

    /// k1..k4.
    pub fn coefficients(&self) -> [f64; 4] {
        self.k
    }

    /// The undistorted radius and its derivative by the distorted one.
    fn undistorted(&self, radius: f64) -> (f64, f64) {
        let [k1, k2, k3, k4] = self.k;
        let s = radius * radius;
        (
            radius * polynomial(&[1.0, k1, k2, k3, k4], s),
            polynomial(&[1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3, 9.0 * k4], s),
        )
    }

    /// From the distortion centre to the undistorted point, and the distorted radius.
    fn radius(&self, point: &Vector3<f64>) -> Option<(Vector2<f64>, f64)> {
        let e = Vector2::new(point.x / point.z, point.y / point.z) - self.centre;
        let radius = invert_increasing(|r| self.undistorted(r), (self.limit, self.top), e.norm())?;
        (point.z > 0.0).then_some((e, radius))
    }
}

impl Bend for InversePolynomial {
    fn bend(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        let (e, radius) = self.radius(point)?;
        Some(self.centre + to_radius(&e, radius, 1.0))
    }

    fn bend_with_jacobian(&self, point: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        let (e, radius) = self.radius(point)?;
        let by_rho = 1.0 / self.undistorted(radius).1;
        let (x, w) = (e + self.centre, 1.0 / point.z);
        let x_by_point = Matrix2x3::new(w, 0.0, -x.x * w, 0.0, w, -x.y * w);
        let m = self.centre + to_radius(&e, radius, 1.0);
        Some((m, to_radius_by_e(&e, radius, by_rho) * x_by_point))
    }

    fn straighten(&self, m: &Vector2<f64>) -> Option<Vector3<f64>> {
        let e = m - self.centre;
        let radius = e.norm();
        let x = self.centre + to_radius(&e, self.undistorted(radius).0, 1.0);
        (radius <= self.limit * (1.0 + f64::EPSILON))
            .then(|| Vector3::new(x.x, x.y, 1.0).normalize())
    }

    fn named(&self) -> Vec<(&'static str, f64)> {
        let values = self.k.into_iter().chain([self.centre.x, self.centre.y]);
        NAMES.into_iter().zip(values).collect()
    }
}
