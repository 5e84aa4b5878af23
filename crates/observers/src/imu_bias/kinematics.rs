//! How velocity and gravity move in the turning body.

use nalgebra::{UnitQuaternion, Vector3};
use sphereflow_sphere::lie::so3;

/// Velocity, gravity and biases, body frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Kinematics {
    /// m/s.
    pub velocity: Vector3<f64>,
    /// m/s^2, downwards.
    pub gravity: Vector3<f64>,
    /// rad/s.
    pub gyro_bias: Vector3<f64>,
    /// m/s^2.
    pub accel_bias: Vector3<f64>,
}

impl Kinematics {
    /// One step of (7.1) with the readings held; returns the rotation of the step, new body from
    /// old. Thesis: eq. (7.1): the turn is exact, so that gravity keeps its norm.
    pub fn step(
        &mut self,
        gyro: &Vector3<f64>,
        accel: &Vector3<f64>,
        dt_s: f64,
    ) -> UnitQuaternion<f64> {
        let turn = so3::exp(&((gyro - self.gyro_bias) * -dt_s));
        self.step_with(gyro, accel, &turn, dt_s);
        turn
    }

    /// The same with gravity turned by another rotation, as the observer (7.4) does.
    pub fn step_with(
        &mut self,
        gyro: &Vector3<f64>,
        accel: &Vector3<f64>,
        gravity_turn: &UnitQuaternion<f64>,
        dt_s: f64,
    ) {
        let omega = gyro - self.gyro_bias;
        let turn = so3::exp(&(omega * -dt_s));
        let force = accel - self.accel_bias;
        self.gravity = gravity_turn * self.gravity;
        let turned_force = force - omega.cross(&force) * (0.5 * dt_s);
        self.velocity = turn * self.velocity + (self.gravity + turned_force) * dt_s;
    }
}
