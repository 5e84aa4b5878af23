//! From velocities to poses and back.

use super::se3;
use sphereflow_core::{Error, Pose, Result, Twist};

/// The pose after `dt_s` seconds of a constant twist in the body's frame:
/// `world_from_body exp([omega, v] dt)`. With `(R, p)` that exponential, a static point at `X1` in
/// the body's frame before and `X2` after has `X1 = R X2 + p`.
///
/// Thesis: eq. (1.8), kept through `dt_s`. Thesis: eq. (C.7) moves world-to-camera matrices instead, on the
/// left, so that its increment is the opposite of this one.
pub fn advance(world_from_body: &Pose, twist: &Twist, dt_s: f64) -> Pose {
    *world_from_body * se3::exp(&(twist.vector() * dt_s))
}

/// The constant twist, in the body's frame, that leads from the pose `first` to `second` (both
/// `world_from_body`) in `dt_s` seconds: the inverse of [`advance`], for angles below pi.
///
/// # Errors
/// [`Error::Value`] where `dt_s` is not positive.
pub fn twist_between(first: &Pose, second: &Pose, dt_s: f64) -> Result<Twist> {
    if dt_s > 0.0 && dt_s.is_finite() {
        let motion = first.inverse() * *second;
        Ok(Twist::from_vector(&(se3::log(&motion) / dt_s)))
    } else {
        Err(Error::value("dt_s", "a positive number of seconds", dt_s))
    }
}
