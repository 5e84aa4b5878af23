//! Quaternions as vectors of four numbers: rates of attitude and continuity of sign.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// The rate of a body's attitude `world_from_body` that turns with `omega_rad_s` in its own frame.
/// Thesis: eq. (1.8). Thesis: eq. (C.4). `q' = q omega / 2`.
pub fn rate(world_from_body: &UnitQuaternion<f64>, omega_rad_s: &Vector3<f64>) -> Quaternion<f64> {
    world_from_body.quaternion() * Quaternion::from_imag(*omega_rad_s) * 0.5
}

/// The angular velocity in the body's own frame of an attitude with rate `q'`: `2 q* q'`, the
/// inverse of [`rate`].
pub fn angular_velocity(
    world_from_body: &UnitQuaternion<f64>,
    rate: &Quaternion<f64>,
) -> Vector3<f64> {
    (world_from_body.quaternion().conjugate() * rate * 2.0).imag()
}

/// Of the two quaternions of the rotation `q`, the one nearer to `previous`: a sequence of
/// attitudes made continuous.
pub fn continued(q: &UnitQuaternion<f64>, previous: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    if q.coords.dot(&previous.coords) < 0.0 {
        UnitQuaternion::new_unchecked(-q.into_inner())
    } else {
        *q
    }
}
