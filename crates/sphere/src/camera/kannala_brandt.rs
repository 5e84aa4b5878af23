//! Kannala and Brandt's fish-eye: the distorted radius is a polynomial of the angle to the axis.

use super::Bend;
use super::radial::{invert_increasing, polynomial, positive_until, to_radius, to_radius_by_e};
use nalgebra::{Matrix2x3, Vector2, Vector3};
use sphereflow_core::{Error, Result};
use std::f64::consts::PI;

/// Names of the parameters.
pub(crate) const NAMES: [&str; 4] = ["k1", "k2", "k3", "k4"];

/// `r_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8)`, theta the angle to the
/// optical axis (Kannala and Brandt 2006; OpenCV's `fisheye`).
///
/// Seen are the angles up to which the polynomial increases, at most 180 degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KannalaBrandt {
    k: [f64; 4],
    limit: f64,
    /// The image of the limit.
    top: f64,
}

impl KannalaBrandt {
    /// From k1..k4.
    ///
    /// # Errors
    /// [`Error::Value`] naming the coefficient that is not finite.
    pub fn new(k: [f64; 4]) -> Result<Self> {
        for (name, value) in NAMES.into_iter().zip(k) {
            if !value.is_finite() {
                return Err(Error::value(name, "a finite number", value));
            }
        }
        let [k1, k2, k3, k4] = k;
        let slope = [1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3, 9.0 * k4]; // in the square
        let mut model = Self {
            k,
            limit: positive_until(&slope, PI * PI).sqrt(),
            top: 0.0,
        };
        model.top = model.distorted(model.limit).0;
        Ok(model)
    }

    /// The largest angle to the optical axis that is seen, radians.
    pub fn limit(&self) -> f64 {
        self.limit
    }

    /// The distorted radius of an angle, and its derivative.
    fn distorted(&self, theta: f64) -> (f64, f64) {
        let [k1, k2, k3, k4] = self.k;
        let s = theta * theta;
        (
            theta * polynomial(&[1.0, k1, k2, k3, k4], s),
            polynomial(&[1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3, 9.0 * k4], s),
        )
    }

    /// (x, y) and the angle to the axis, where it is seen. Straight behind, (0, 0) has no direction.
    fn angle(&self, point: &Vector3<f64>) -> Option<(Vector2<f64>, f64)> {
        let e = Vector2::new(point.x, point.y);
        let theta = e.norm().atan2(point.z);
        let directed = e.norm() > 0.0 || point.z > 0.0;
        let seen = directed && theta <= self.limit * (1.0 + f64::EPSILON);
        seen.then_some((e, theta))
    }
}

impl Bend for KannalaBrandt {
    fn bend(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        let (e, theta) = self.angle(point)?;
        Some(to_radius(&e, self.distorted(theta).0, 1.0 / point.z))
    }

    fn bend_with_jacobian(&self, point: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        let (e, theta) = self.angle(point)?;
        let (radius, by_theta) = self.distorted(theta);
        let norm2 = point.norm_squared();
        let by_e = to_radius_by_e(&e, radius, by_theta * point.z / norm2);
        let jacobian = Matrix2x3::from_columns(&[
            by_e.column(0).into_owned(),
            by_e.column(1).into_owned(),
            e * (-by_theta / norm2),
        ]);
        Some((to_radius(&e, radius, 1.0 / point.z), jacobian))
    }

    fn straighten(&self, m: &Vector2<f64>) -> Option<Vector3<f64>> {
        let theta = invert_increasing(|t| self.distorted(t), (self.limit, self.top), m.norm())?;
        let x = to_radius(m, theta.sin(), 1.0);
        Some(Vector3::new(x.x, x.y, theta.cos()).normalize())
    }

    fn named(&self) -> Vec<(&'static str, f64)> {
        NAMES.into_iter().zip(self.k).collect()
    }
}
