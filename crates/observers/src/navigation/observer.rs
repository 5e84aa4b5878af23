//! The thesis's observer of velocity and position.
//!
//! Thesis: eq. (9.5), with gravity added: `v' = v x omega_m + a_m + q* G q + ...`, G = (0, +9.81, 0)
//! with y down. As printed (`- q* A q`) it stands 1 m and 4 m/s off.

use crate::error::positive;
use crate::{Reason, Result, Sensor, Status};
use nalgebra::{UnitQuaternion, Vector3};
use sphereflow_sphere::lie::so3;

/// Gains of [`PositionObserver`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionGains {
    /// Velocity from velocity, 1/s.
    pub k_v: f64,
    /// Velocity from position, 1/s^2.
    pub k_vx: f64,
    /// Position from position, 1/s.
    pub k_x: f64,
}

impl Default for PositionGains {
    fn default() -> Self {
        Self {
            k_v: 4.0,
            k_vx: 4.0,
            k_x: 4.0,
        }
    }
}

/// Velocity in the body and position in the world, from inertial readings, body velocity and
/// position. Debiased readings and the attitude come from elsewhere (section 9.6.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionObserver {
    gains: PositionGains,
    gravity: Vector3<f64>,
    velocity: Vector3<f64>,
    position: Vector3<f64>,
}

impl PositionObserver {
    /// From the first velocity (body) and position (world). `gravity` is gravity itself in the
    /// world, m/s^2.
    ///
    /// # Errors
    /// A value error naming the gain that is not positive.
    pub fn new(
        gains: PositionGains,
        gravity: Vector3<f64>,
        velocity: Vector3<f64>,
        position: Vector3<f64>,
    ) -> Result<Self> {
        for (name, gain) in [("k_v", gains.k_v), ("k_vx", gains.k_vx), ("k_x", gains.k_x)] {
            positive(name, gain)?;
        }
        Ok(Self {
            gains,
            gravity,
            velocity,
            position,
        })
    }

    /// One step with readings at its end: gyro and accelerometer, the attitude `world_from_body`, and
    /// velocity (body) and position (world) where measured. Thesis: eq. (9.5).
    pub fn step(
        &mut self,
        gyro: &Vector3<f64>,
        accel: &Vector3<f64>,
        world_from_body: &UnitQuaternion<f64>,
        velocity: Option<&Vector3<f64>>,
        position: Option<&Vector3<f64>>,
        dt_s: f64,
    ) -> Status {
        if !(dt_s > 0.0 && dt_s.is_finite()) {
            return Status::Skipped(Reason::StampNotIncreasing);
        }
        let finite = |v: Option<&Vector3<f64>>| v.is_none_or(|v| v.iter().all(|x| x.is_finite()));
        for (sensor, value) in [
            (Sensor::Gyro, Some(gyro)),
            (Sensor::Accel, Some(accel)),
            (Sensor::Velocity, velocity),
            (Sensor::Pose, position),
        ] {
            if !finite(value) {
                return Status::Skipped(Reason::NotFinite { sensor });
            }
        }
        let gains = &self.gains;
        let to_body = world_from_body.inverse();
        let before = so3::exp(&(gyro * (0.5 * dt_s)));
        let middle = *world_from_body * before.inverse();
        let force = accel + to_body * self.gravity;
        self.position += middle * self.velocity * dt_s;
        self.velocity = so3::exp(&(gyro * -dt_s)) * self.velocity + before.inverse() * force * dt_s;
        let share = |gain: f64| 1.0 - (-gain * dt_s).exp();
        if let Some(measured) = position {
            let error = measured - self.position;
            self.velocity += to_body * error * (gains.k_vx * dt_s);
            self.position += error * share(gains.k_x);
        }
        if let Some(measured) = velocity {
            self.velocity += (measured - self.velocity) * share(gains.k_v);
        }
        match (velocity, position) {
            (None, None) => Status::Weak(Reason::Coasting { seconds: dt_s }),
            _ => Status::Ok,
        }
    }

    /// Velocity, body frame, m/s.
    pub fn velocity(&self) -> Vector3<f64> {
        self.velocity
    }

    /// Position, world frame, m.
    pub fn position(&self) -> Vector3<f64> {
        self.position
    }
}
