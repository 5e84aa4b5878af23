//! OpenCV's rational radial and tangential distortion.

use super::Bend;
use super::radial::{
    FARTHEST, INVERSE_RESIDUAL, invert_increasing, polynomial, positive_until, to_radius,
};
use nalgebra::{Matrix2, Matrix2x3, Vector2, Vector3};
use sphereflow_core::{Error, Result};

/// Names of the parameters, in OpenCV's order.
pub(crate) const NAMES: [&str; 8] = ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"];

/// With `x = (X/Z, Y/Z)`, `s = |x|^2` and `p = (p2, p1)`:
/// `m = x (1 + k1 s + k2 s^2 + k3 s^3) / (1 + k4 s + k5 s^2 + k6 s^3) + s p + 2 (p.x) x`
/// (the documentation of OpenCV's `calib3d`).
///
/// Thesis: section 1.1.1 names the radial distortion; these terms are OpenCV's.
///
/// The polynomials fold back at some radius. The derivative of `m` is symmetric, and positive
/// definite on the whole disc on which `(r g)' > 6 |p| r` and `g > 4 |p| r` (`g` the quotient,
/// `r = |x|`): there `m` is one to one. Points outside the largest such disc are not seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Opencv {
    numerator: [f64; 4],
    denominator: [f64; 4],
    p: Vector2<f64>,
    limit: f64,
    /// The distorted radius at the limit, without tangential terms.
    top: f64,
}

impl Opencv {
    /// From k1, k2, p1, p2, k3, k4, k5, k6, in OpenCV's order.
    ///
    /// # Errors
    /// [`Error::Value`] naming the coefficient that is not finite.
    pub fn new(coefficients: [f64; 8]) -> Result<Self> {
        for (name, value) in NAMES.into_iter().zip(coefficients) {
            if !value.is_finite() {
                return Err(Error::value(name, "a finite number", value));
            }
        }
        let [k1, k2, p1, p2, k3, k4, k5, k6] = coefficients;
        let mut model = Self {
            numerator: [1.0, k1, k2, k3],
            denominator: [1.0, k4, k5, k6],
            p: Vector2::new(p2, p1),
            limit: FARTHEST,
            top: FARTHEST,
        };
        model.limit = model.one_to_one_until();
        model.top = model.radial(model.limit).0;
        Ok(model)
    }

    /// The largest undistorted radius (tangent of the angle to the optical axis) that is seen.
    pub fn limit(&self) -> f64 {
        self.limit
    }

    /// Radius of the disc on which the distortion is one to one, from the polynomials in r.
    fn one_to_one_until(&self) -> f64 {
        let (n, d, p) = (&self.numerator, &self.denominator, self.p.norm());
        // slope * d^2 = n d + 2 s (n' d - n d'), in r; and the odd powers of -6 |p| r d^2
        let (mut slope, mut quotient, mut pole) = ([0.0; 14], [0.0; 8], [0.0; 7]);
        for i in 0..4 {
            for j in 0..4 {
                let turn = 1.0 + 2.0 * (i as f64 - j as f64);
                slope[2 * (i + j)] += turn * n[i] * d[j];
                slope[2 * (i + j) + 1] -= 6.0 * p * d[i] * d[j];
            }
            quotient[2 * i] = n[i];
            quotient[2 * i + 1] = -4.0 * p * d[i];
            pole[2 * i] = d[i];
        }
        positive_until(&slope, FARTHEST)
            .min(positive_until(&quotient, FARTHEST))
            .min(positive_until(&pole, FARTHEST))
    }

    /// The quotient g and its derivative by s.
    fn quotient(&self, s: f64) -> (f64, f64) {
        let slope = |c: &[f64; 4]| polynomial(&[c[1], 2.0 * c[2], 3.0 * c[3]], s);
        let (n, d) = (
            polynomial(&self.numerator, s),
            polynomial(&self.denominator, s),
        );
        let g = n / d;
        (
            g,
            (slope(&self.numerator) - g * slope(&self.denominator)) / d,
        )
    }

    /// The distorted point and its derivative by the undistorted one.
    fn distort(&self, x: &Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        let (s, along) = (x.norm_squared(), self.p.dot(x));
        let (g, g_by_s) = self.quotient(s);
        let mixed = self.p * x.transpose();
        let jacobian = Matrix2::identity() * (g + 2.0 * along)
            + x * x.transpose() * (2.0 * g_by_s)
            + (mixed + mixed.transpose()) * 2.0;
        (x * (g + 2.0 * along) + self.p * s, jacobian)
    }

    /// The distorted radius without tangential terms, and its derivative by the radius.
    fn radial(&self, r: f64) -> (f64, f64) {
        let (g, g_by_s) = self.quotient(r * r);
        (r * g, g + 2.0 * r * r * g_by_s)
    }

    /// The undistorted point within the limit: the radial part by a bracketed Newton, then, with
    /// tangential terms, a damped Newton that never leaves the disc.
    fn undistort(&self, m: &Vector2<f64>) -> Option<Vector2<f64>> {
        let radius = invert_increasing(|r| self.radial(r), (self.limit, self.top), m.norm());
        if self.p == Vector2::zeros() {
            return Some(to_radius(m, radius?, 1.0));
        }
        let mut x = to_radius(m, radius.unwrap_or(self.limit), 1.0);
        let (mut residual, mut jacobian) = self.residual(&x, m);
        for _ in 0..100 {
            if residual.norm() <= f64::EPSILON * m.norm() {
                return Some(x);
            }
            let step = jacobian.try_inverse()? * residual;
            let Some(nearer) = self.nearer(&x, &step, m, residual.norm()) else {
                break; // rounding: nothing nearer is found
            };
            (x, residual, jacobian) = nearer;
        }
        (residual.norm() <= INVERSE_RESIDUAL * (1.0 + m.norm())).then_some(x)
    }

    /// The first point along `-step`, halved up to 30 times, with a residual below `best`; with its
    /// residual and derivative.
    fn nearer(
        &self,
        x: &Vector2<f64>,
        step: &Vector2<f64>,
        m: &Vector2<f64>,
        best: f64,
    ) -> Option<(Vector2<f64>, Vector2<f64>, Matrix2<f64>)> {
        let mut step = *step;
        for _ in 0..30 {
            let next = x - step;
            let next = next * (self.limit / next.norm()).min(1.0);
            let (residual, jacobian) = self.residual(&next, m);
            if residual.norm() < best {
                return Some((next, residual, jacobian));
            }
            if best <= INVERSE_RESIDUAL * 0.1 {
                return None; // found, to rounding
            }
            step *= 0.5;
        }
        None
    }

    fn residual(&self, x: &Vector2<f64>, m: &Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        let (distorted, jacobian) = self.distort(x);
        (distorted - m, jacobian)
    }

    /// `X/Z, Y/Z`, where it is seen.
    fn undistorted(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        let x = Vector2::new(point.x / point.z, point.y / point.z);
        (point.z > 0.0 && x.norm() <= self.limit * (1.0 + f64::EPSILON)).then_some(x)
    }
}

impl Bend for Opencv {
    fn bend(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        let x = self.undistorted(point)?;
        let (g, _) = self.quotient(x.norm_squared());
        Some(x * (g + 2.0 * self.p.dot(&x)) + self.p * x.norm_squared())
    }

    fn bend_with_jacobian(&self, point: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        let x = self.undistorted(point)?;
        let w = 1.0 / point.z;
        let (m, m_by_x) = self.distort(&x);
        let x_by_point = Matrix2x3::new(w, 0.0, -x.x * w, 0.0, w, -x.y * w);
        Some((m, m_by_x * x_by_point))
    }

    fn straighten(&self, m: &Vector2<f64>) -> Option<Vector3<f64>> {
        let x = self.undistort(m)?;
        Some(Vector3::new(x.x, x.y, 1.0).normalize())
    }

    fn named(&self) -> Vec<(&'static str, f64)> {
        let ([_, k1, k2, k3], [_, k4, k5, k6]) = (self.numerator, self.denominator);
        let values = [k1, k2, self.p.y, self.p.x, k3, k4, k5, k6];
        NAMES.into_iter().zip(values).collect()
    }
}
