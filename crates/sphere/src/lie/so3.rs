//! Rotations: exponential, logarithm, Jacobians.

use super::series;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// The skew-symmetric matrix with `hat(w) x = w x x` (cross product). Thesis: eq. (C.1).
pub fn hat(w: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -w.z, w.y, w.z, 0.0, -w.x, -w.y, w.x, 0.0)
}

/// The vector of the skew-symmetric part of a matrix: the inverse of [`hat`].
pub fn vee(m: &Matrix3<f64>) -> Vector3<f64> {
    Vector3::new(
        0.5 * (m[(2, 1)] - m[(1, 2)]),
        0.5 * (m[(0, 2)] - m[(2, 0)]),
        0.5 * (m[(1, 0)] - m[(0, 1)]),
    )
}

/// The rotation by the angle |w| about w. Thesis: section C.1.2, `(cos t/2, sin(t/2)/t w)`.
pub fn exp(w: &Vector3<f64>) -> UnitQuaternion<f64> {
    let half = 0.5 * w.norm();
    let vector = w * (0.5 * series::sinc(half));
    UnitQuaternion::new_unchecked(Quaternion::from_parts(half.cos(), vector))
}

/// The rotation vector of angle at most pi; at pi itself, one of its two.
pub fn log(q: &UnitQuaternion<f64>) -> Vector3<f64> {
    let scalar = q.w.abs();
    let vector = if q.w < 0.0 { -q.imag() } else { q.imag() };
    let sine = vector.norm();
    // 2 atan2(s, c) / s, whose series at 0 spares the quotient of two tiny numbers
    let ratio = sine / scalar;
    if ratio < 1e-4 {
        let r2 = ratio * ratio;
        vector * (2.0 / scalar * (1.0 - r2 / 3.0 + r2 * r2 / 5.0))
    } else {
        vector * (2.0 * sine.atan2(scalar) / sine)
    }
}

/// How a rotation moves rotation vectors: `q exp(w) q^-1 = exp(adjoint(q) w)`; its matrix.
pub fn adjoint(q: &UnitQuaternion<f64>) -> Matrix3<f64> {
    q.to_rotation_matrix().into_inner()
}

/// `exp(w + d) = exp(left_jacobian(w) d) exp(w)` to first order in `d`.
pub fn left_jacobian(w: &Vector3<f64>) -> Matrix3<f64> {
    let (angle, hat) = (w.norm(), hat(w));
    Matrix3::identity() + hat * series::versine(angle) + hat * hat * series::third(angle)
}

/// `exp(w + d) = exp(w) exp(right_jacobian(w) d)` to first order in `d`.
pub fn right_jacobian(w: &Vector3<f64>) -> Matrix3<f64> {
    left_jacobian(&-w)
}

/// The inverse of [`left_jacobian`]; it does not exist at the full turn, where it is infinite.
pub fn left_jacobian_inverse(w: &Vector3<f64>) -> Matrix3<f64> {
    let hat = hat(w);
    Matrix3::identity() - hat * 0.5 + hat * hat * series::inverse(w.norm())
}

/// The inverse of [`right_jacobian`]: `log(q exp(d)) = log(q) + right_jacobian_inverse d` to first
/// order.
pub fn right_jacobian_inverse(w: &Vector3<f64>) -> Matrix3<f64> {
    left_jacobian_inverse(&-w)
}
