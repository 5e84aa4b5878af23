//! The invariant observer of gyro, accelerometer and magnetometer with gyro bias.
//!
//! Thesis: section 9.4, after Martin and Salaün, "Design and implementation of a low-cost
//! observer-based attitude and heading reference system", 2010: linear acceleration is neglected,
//! and the magnetometer is used through its cross product with the vertical, so that it turns the
//! heading alone. Errors are formed in the earth frame, where the observer is invariant.

use super::config::AttitudeConfig;
use super::low_pass::Decay;
use super::magnetic::{FieldJudge, FieldTable};
use super::rest::{REST_TAU_S, RestDetector};
use super::small_angle;
use crate::Reason;
use crate::checks::accel_unit;
use nalgebra::{UnitQuaternion, Vector3};

/// The observer: `q' = q (omega_m - b + q* k e q) / 2`, `b' = -n q* e q` with
/// `e = (q a q*)/|a| x up + ((q (a x m) q*)/|.| x west . up) up`.
#[derive(Clone, Copy, Debug)]
pub struct InvariantObserver {
    gain: f64,
    bias_gain: f64,
    clip: f64,
    rotation: UnitQuaternion<f64>,
    bias: Vector3<f64>,
    started: bool,
    heading_known: bool,
    last_east: Option<Vector3<f64>>,
    rest: RestDetector,
    field: Option<FieldJudge>,
    tau_mag_s: f64,
    tables: (Decay, FieldTable),
    since_mag_s: f64,
}

/// A specific force beyond this, m/s^2, does not point up: it is some 4 g of anything else.
const LARGEST_M_S2: f64 = 45.0;
/// Steps closer to each other than this share use the same low-passes.
const SAME_STEP: f64 = 1e-3;

impl InvariantObserver {
    /// Before the first sample.
    pub fn new(config: &AttitudeConfig) -> Self {
        Self {
            gain: config.invariant_gain,
            bias_gain: config.invariant_bias_gain,
            clip: 10.0 * config.bias_clip_rad_s,
            rotation: UnitQuaternion::identity(),
            bias: Vector3::zeros(),
            started: false,
            heading_known: false,
            last_east: None,
            rest: RestDetector::new(),
            field: config.reject_disturbance.then(FieldJudge::new),
            tau_mag_s: config.tau_mag_s,
            tables: (
                Decay::new(REST_TAU_S, 0.01),
                FieldTable::new(config.tau_mag_s, 0.01),
            ),
            since_mag_s: 0.0,
        }
    }

    /// Gyro alone.
    pub fn turn(&mut self, gyro: &Vector3<f64>, dt_s: f64) {
        self.since_mag_s += dt_s;
        self.rotation *= small_angle::turn(&((gyro - self.bias) * dt_s));
        self.rotation.renormalize();
    }

    /// One step. Thesis: section 9.4.
    pub fn step(
        &mut self,
        gyro: &Vector3<f64>,
        accel: &Vector3<f64>,
        mag: Option<&Vector3<f64>>,
        dt_s: f64,
    ) {
        self.watch(gyro, accel, dt_s);
        let norm = accel.norm();
        if !(1e-9..LARGEST_M_S2).contains(&norm) {
            return self.turn(gyro, dt_s);
        }
        let up_body = accel / norm;
        let mag = mag.filter(|mag| self.believes(mag, dt_s));
        let east_body = mag
            .map(|m| m.cross(&up_body))
            .and_then(|east| east.try_normalize(1e-9))
            .or(mag.and(self.last_east));
        self.last_east = east_body;
        self.start(&up_body, east_body.as_ref());
        // The sample is of the end of the step: turn first, then correct.
        self.turn(gyro, dt_s);
        let correction = self.error(&up_body, east_body.as_ref());
        let body = self.rotation.inverse_transform_vector(&correction);
        self.bias =
            (self.bias - body * (self.bias_gain * dt_s)).map(|b| b.clamp(-self.clip, self.clip));
        self.rotation *= small_angle::turn(&(body * (self.gain * dt_s)));
        self.rotation.renormalize();
    }

    /// Rest, and the mean reading of the accelerometer.
    fn watch(&mut self, gyro: &Vector3<f64>, accel: &Vector3<f64>, dt_s: f64) {
        if (dt_s - self.tables.1.dt_s).abs() > SAME_STEP * dt_s {
            self.tables = (
                Decay::new(REST_TAU_S, dt_s),
                FieldTable::new(self.tau_mag_s, dt_s),
            );
        }
        let clip = self.clip;
        self.rest.step(gyro, accel, clip, dt_s, &self.tables.0);
    }

    /// True where the field may turn the heading.
    fn believes(&mut self, mag: &Vector3<f64>, dt_s: f64) -> bool {
        let earth = self.rotation * mag;
        let (flat, norm) = (earth.xy().norm(), earth.norm());
        let since_s = std::mem::take(&mut self.since_mag_s).max(dt_s);
        let Some(field) = self.field.as_mut().filter(|_| norm > 1e-12) else {
            return true;
        };
        let mean = self.rest.mean_gyro();
        field.step(norm, flat, -earth.z, &mean, since_s, &self.tables.1);
        let weight = field.weight(since_s);
        !field.is_disturbed() || weight > 0.0
    }

    /// True at rest.
    pub fn is_at_rest(&self) -> bool {
        self.rest.is_at_rest()
    }

    /// What the accelerometer's mean says of its unit, once known.
    pub fn accel_unit(&self) -> Option<Reason> {
        let known = self.rest.is_settled();
        known.then(|| accel_unit(&self.rest.mean_accel())).flatten()
    }

    /// True where the field is not the one that is believed.
    pub fn is_disturbed(&self) -> bool {
        self.field.is_some_and(|field| field.is_disturbed())
    }

    /// The rotation, earth frame, that would carry the measured directions to where they belong;
    /// its size is the sine of the angle.
    fn error(&self, up_body: &Vector3<f64>, east_body: Option<&Vector3<f64>>) -> Vector3<f64> {
        let up = self.rotation * up_body;
        let mut error = up.cross(&Vector3::z());
        if let Some(east_body) = east_body {
            let east = self.rotation * east_body;
            error += Vector3::z() * east.cross(&Vector3::x()).z;
        }
        error
    }

    /// The first sample, and the first with a field, set what they know.
    fn start(&mut self, up_body: &Vector3<f64>, east_body: Option<&Vector3<f64>>) {
        if !self.started {
            self.started = true;
            self.rotation = UnitQuaternion::rotation_between(up_body, &Vector3::z())
                .unwrap_or_else(|| {
                    UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
                });
        }
        if let (false, Some(east_body)) = (self.heading_known, east_body) {
            self.heading_known = true;
            let east = self.rotation * east_body;
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -east.y.atan2(east.x));
            self.rotation = turn * self.rotation;
        }
    }

    /// Earth (east, north, up) from body.
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        self.rotation
    }

    /// The gyro's bias, rad/s.
    pub fn bias(&self) -> Vector3<f64> {
        self.bias
    }

    /// Set the state, for tests of convergence.
    #[cfg(test)]
    pub fn set(&mut self, rotation: UnitQuaternion<f64>, bias: Vector3<f64>) {
        (self.rotation, self.bias) = (rotation, bias);
        (self.started, self.heading_known) = (true, true);
    }
}
