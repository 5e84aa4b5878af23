//! Samples of inertial and magnetic sensors, and the twist of a moving body.

use crate::Stamp;
use nalgebra::{Vector3, Vector6};

/// One reading of gyro and accelerometer, in the sensor's own frame.
///
/// A sensor that a device lacks reads NaN: a recording with an accelerometer alone has
/// `gyro_rad_s` NaN in every sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuSample {
    /// Time of the reading.
    pub stamp: Stamp,
    /// Angular velocity of the body, rad/s.
    pub gyro_rad_s: Vector3<f64>,
    /// Specific force, m/s^2: at rest it points up, with norm 9.81.
    pub accel_m_s2: Vector3<f64>,
}

/// One reading of a magnetometer, in the sensor's own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagSample {
    /// Time of the reading.
    pub stamp: Stamp,
    /// Magnetic flux density, microtesla.
    pub mag_ut: Vector3<f64>,
}

/// Velocities of a body in its own frame, in the order `[omega, v]`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Twist {
    /// Angular velocity, rad/s, body frame.
    pub angular_rad_s: Vector3<f64>,
    /// Linear velocity, m/s, body frame: the thesis's v = q* C' q (1.8).
    pub linear_m_s: Vector3<f64>,
}

impl Twist {
    /// From `[omega, v]`.
    pub fn from_vector(omega_v: &Vector6<f64>) -> Self {
        Self {
            angular_rad_s: omega_v.fixed_rows::<3>(0).into_owned(),
            linear_m_s: omega_v.fixed_rows::<3>(3).into_owned(),
        }
    }

    /// As `[omega, v]`.
    pub fn vector(&self) -> Vector6<f64> {
        let (w, v) = (self.angular_rad_s, self.linear_m_s);
        Vector6::new(w.x, w.y, w.z, v.x, v.y, v.z)
    }
}
