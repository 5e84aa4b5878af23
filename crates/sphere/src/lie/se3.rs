//! Rigid motions: exponential, logarithm, adjoint and Jacobians of twists `[omega, v]`.

use super::{series, so3};
use nalgebra::{Matrix3, Matrix4, Matrix6, Vector3, Vector6};
use sphereflow_core::Pose;

fn parts(xi: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (
        xi.fixed_rows::<3>(0).into_owned(),
        xi.fixed_rows::<3>(3).into_owned(),
    )
}

fn stack(omega: &Vector3<f64>, v: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(omega.x, omega.y, omega.z, v.x, v.y, v.z)
}

/// `[[a, 0], [b, a]]`
fn lower(a: &Matrix3<f64>, b: &Matrix3<f64>) -> Matrix6<f64> {
    let mut m = Matrix6::zeros();
    m.fixed_view_mut::<3, 3>(0, 0).copy_from(a);
    m.fixed_view_mut::<3, 3>(3, 0).copy_from(b);
    m.fixed_view_mut::<3, 3>(3, 3).copy_from(a);
    m
}

/// The matrix `[[hat(omega), v], [0, 0]]` of a twist `[omega, v]`. Thesis: section C.3.
pub fn hat(xi: &Vector6<f64>) -> Matrix4<f64> {
    let (omega, v) = parts(xi);
    let mut m = Matrix4::zeros();
    m.fixed_view_mut::<3, 3>(0, 0).copy_from(&so3::hat(&omega));
    m.fixed_view_mut::<3, 1>(0, 3).copy_from(&v);
    m
}

/// The twist of a matrix of the algebra: the inverse of [`hat`].
pub fn vee(m: &Matrix4<f64>) -> Vector6<f64> {
    let omega = so3::vee(&m.fixed_view::<3, 3>(0, 0).into_owned());
    stack(&omega, &m.fixed_view::<3, 1>(0, 3).into_owned())
}

/// The rigid motion of a twist kept for a unit of time. Thesis: section C.3.
pub fn exp(xi: &Vector6<f64>) -> Pose {
    let (omega, v) = parts(xi);
    Pose::new(so3::exp(&omega), so3::left_jacobian(&omega) * v)
}

/// The twist of a rigid motion, of angle at most pi.
pub fn log(pose: &Pose) -> Vector6<f64> {
    let omega = so3::log(&pose.rotation);
    stack(
        &omega,
        &(so3::left_jacobian_inverse(&omega) * pose.translation),
    )
}

/// How a rigid motion moves twists: `T exp(xi) T^-1 = exp(adjoint(T) xi)`.
pub fn adjoint(pose: &Pose) -> Matrix6<f64> {
    let rotation = so3::adjoint(&pose.rotation);
    lower(&rotation, &(so3::hat(&pose.translation) * rotation))
}

/// The derivative of [`adjoint`] at the identity: `small_adjoint(a) b` is the bracket `[a, b]`.
pub fn small_adjoint(xi: &Vector6<f64>) -> Matrix6<f64> {
    let (omega, v) = parts(xi);
    lower(&so3::hat(&omega), &so3::hat(&v))
}

/// `exp(xi + d) = exp(left_jacobian(xi) d) exp(xi)` to first order in `d`.
pub fn left_jacobian(xi: &Vector6<f64>) -> Matrix6<f64> {
    let (omega, v) = parts(xi);
    lower(&so3::left_jacobian(&omega), &coupling(&omega, &v))
}

/// `exp(xi + d) = exp(xi) exp(right_jacobian(xi) d)` to first order in `d`.
pub fn right_jacobian(xi: &Vector6<f64>) -> Matrix6<f64> {
    left_jacobian(&-xi)
}

/// The inverse of [`left_jacobian`]; it does not exist at the full turn.
pub fn left_jacobian_inverse(xi: &Vector6<f64>) -> Matrix6<f64> {
    let (omega, v) = parts(xi);
    let inverse = so3::left_jacobian_inverse(&omega);
    lower(&inverse, &(-inverse * coupling(&omega, &v) * inverse))
}

/// The inverse of [`right_jacobian`]: `log(T exp(d)) = log(T) + right_jacobian_inverse d` to first
/// order.
pub fn right_jacobian_inverse(xi: &Vector6<f64>) -> Matrix6<f64> {
    left_jacobian_inverse(&-xi)
}

/// The matrix Q(omega, v) by which translation depends on rotation in the left Jacobian
/// (Barfoot, "State Estimation for Robotics", section 7.1.5).
fn coupling(omega: &Vector3<f64>, v: &Vector3<f64>) -> Matrix3<f64> {
    let (w, v, angle) = (so3::hat(omega), so3::hat(v), omega.norm());
    let wvw = w * v * w;
    v * 0.5
        + (w * v + v * w + wvw) * series::third(angle)
        + (w * w * v + v * w * w - wvw * 3.0) * series::fourth(angle)
        + (wvw * w + w * wvw) * series::fifth(angle)
}
