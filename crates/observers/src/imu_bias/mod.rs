//! Biases of gyro and accelerometer, and gravity, from velocities measured in images (Chapter 7).
//!
//! All in the body frame. Thesis: eq. (7.1), with `g = q* G q` (gravity itself, downwards):
//! `v' = v x (omega_m - omega_b) + g + a_m - a_b`, `g' = g x (omega_m - omega_b)`, constant biases.

mod config;
mod field;
mod filter;
mod kalman;
mod kinematics;
mod observability;
mod observer;
mod record;
#[cfg(test)]
mod tests;

pub use config::{ImuBiasConfig, ImuBiasMethod};
pub use filter::{ImuBiasEstimator, ImuBiasState};
pub use observability::Excitation;
pub use observer::ObserverGains;
pub use record::{ImuBiasRun, ImuBiasSample};

use crate::{Reason, Sensor, limits};
use nalgebra::{Matrix3, Vector3};

/// A velocity from images, body frame, at the end of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityMeasurement {
    /// m/s.
    pub linear_m_s: Vector3<f64>,
    /// Its covariance.
    pub linear_covariance: Matrix3<f64>,
    /// rad/s, where it was measured too: its difference to the gyro measures the gyro's bias.
    pub angular_rad_s: Option<Vector3<f64>>,
    /// Its covariance.
    pub angular_covariance: Matrix3<f64>,
    /// True where the linear velocity is the mean since the velocity before, as `log(R, p) / dt` of
    /// two images is; false for the velocity at the instant.
    pub is_mean: bool,
    /// The same of the angular velocity.
    pub is_mean_angular: bool,
}

impl VelocityMeasurement {
    /// With the same standard deviation on each axis.
    pub fn isotropic(
        linear: Vector3<f64>,
        sigma_m_s: f64,
        angular: Option<Vector3<f64>>,
        sigma_rad_s: f64,
    ) -> Self {
        Self {
            linear_m_s: linear,
            linear_covariance: Matrix3::identity() * (sigma_m_s * sigma_m_s),
            angular_rad_s: angular,
            angular_covariance: Matrix3::identity() * (sigma_rad_s * sigma_rad_s),
            is_mean: false,
            is_mean_angular: false,
        }
    }

    /// With an angular velocity that is the mean since the velocity before.
    pub fn with_mean_angular(mut self, angular_rad_s: Option<Vector3<f64>>) -> Self {
        (self.angular_rad_s, self.is_mean_angular) = (angular_rad_s, true);
        self
    }

    /// Why this is no measurement.
    pub(crate) fn refused(&self) -> Option<Reason> {
        let sensor = Sensor::Velocity;
        let linear = limits::refused(sensor, &self.linear_m_s, limits::SPEED_M_S)
            .or_else(|| limits::refused_covariance(sensor, &self.linear_covariance));
        let angular = || {
            let omega = self.angular_rad_s?;
            limits::refused(sensor, &omega, limits::GYRO_RAD_S)
                .or_else(|| limits::refused_covariance(sensor, &self.angular_covariance))
        };
        linear.or_else(angular)
    }
}
