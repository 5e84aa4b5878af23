//! A camera that moves while its rows are exposed.

use super::intrinsics::Intrinsics;
use crate::Result;
use nalgebra::{Matrix3, Vector3};
use sphereflow_core::checks::all_finite;

/// How the camera moves about the time of its pose, all in its own frame: a row that is exposed `t`
/// seconds later sees a point `y` of the pose's frame at `y + t d + t^2/2 e`, with
/// `d = -(w x y) - v`, `e = -(w x d)` and the mean twist `(w, v)` of that time, which is the twist
/// plus `t/2` times its derivative. Good to third order in `t`; at 3 rad/s and 15 ms, the half of a
/// read-out of 30 ms, that is 1.5e-5 rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowMotion {
    /// Angular velocity, rad/s.
    pub omega: Vector3<f64>,
    /// Velocity, m/s.
    pub velocity: Vector3<f64>,
    /// Derivative of the angular velocity, rad/s^2.
    pub omega_rate: Vector3<f64>,
    /// Derivative of the velocity's components in the camera's axes, m/s^2.
    pub velocity_rate: Vector3<f64>,
}

/// A camera that does not move.
pub(crate) static STILL: RowMotion = RowMotion {
    omega: Vector3::new(0.0, 0.0, 0.0),
    velocity: Vector3::new(0.0, 0.0, 0.0),
    omega_rate: Vector3::new(0.0, 0.0, 0.0),
    velocity_rate: Vector3::new(0.0, 0.0, 0.0),
};

impl Default for RowMotion {
    fn default() -> Self {
        STILL
    }
}

/// A camera's parameters, and how it moves.
#[derive(Clone, Copy)]
pub(crate) struct CameraState<'a> {
    pub intrinsics: &'a Intrinsics,
    pub rows: &'a RowMotion,
}

/// A point as a row sees it, with derivatives.
pub(crate) struct Moved {
    pub point: Vector3<f64>,
    /// By the point in the frame of the pose.
    pub by_point: Matrix3<f64>,
    /// By the time of the row.
    pub by_time: Vector3<f64>,
}

impl RowMotion {
    /// # Errors
    /// Where a number is not finite.
    pub(crate) fn check(&self) -> Result<()> {
        all_finite("omega", &self.omega)?;
        all_finite("velocity", &self.velocity)?;
        all_finite("omega_rate", &self.omega_rate)?;
        Ok(all_finite("velocity_rate", &self.velocity_rate)?)
    }

    /// Where a row that is exposed `t` seconds after the pose's time sees the point `y`.
    #[inline(always)]
    pub fn seen_at(&self, y: &Vector3<f64>, t: f64) -> Vector3<f64> {
        let (w, v) = self.mean(t);
        let d = -w.cross(y) - v;
        y + d * t - w.cross(&d) * (0.5 * t * t)
    }

    /// The point of the pose's frame that a row sees at `x`: the inverse of [`RowMotion::seen_at`].
    /// `None` where the camera turns so far in `t` that there is none.
    pub fn in_pose(&self, x: &Vector3<f64>, t: f64) -> Option<Vector3<f64>> {
        // affine in the point
        let moved = self.with_derivatives(&Vector3::zeros(), t);
        let back = moved.by_point.try_inverse()?;
        Some(back * (x - moved.point))
    }

    /// [`RowMotion::seen_at`] with its derivatives.
    #[inline(always)]
    pub(crate) fn with_derivatives(&self, y: &Vector3<f64>, t: f64) -> Moved {
        let (w, v) = self.mean(t);
        let d = -w.cross(y) - v;
        let e = -w.cross(&d);
        let d_rate = -(self.omega_rate.cross(y) + self.velocity_rate) * 0.5;
        let e_rate = -self.omega_rate.cross(&d) * 0.5 - w.cross(&d_rate);
        let half = 0.5 * t * t;
        let cross = w.cross_matrix();
        Moved {
            point: y + d * t + e * half,
            by_point: Matrix3::identity() - cross * t + cross * cross * half,
            by_time: d + (e + d_rate) * t + e_rate * half,
        }
    }

    #[inline(always)]
    fn mean(&self, t: f64) -> (Vector3<f64>, Vector3<f64>) {
        let half = 0.5 * t;
        (
            self.omega + self.omega_rate * half,
            self.velocity + self.velocity_rate * half,
        )
    }
}
