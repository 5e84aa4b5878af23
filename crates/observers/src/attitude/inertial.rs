//! The estimator of today's standard: strapdown integration whose inclination and heading are
//! corrected apart, so that a disturbed field never tilts the horizon.
//!
//! After Laidig and Seel, "VQF: Highly accurate IMU orientation estimation with bias estimation and
//! magnetic disturbance rejection", Information Fusion 91, 2023; the low-pass is exact for any step.

use super::bias::{BiasFilter, BiasNoise};
use super::config::AttitudeConfig;
use super::low_pass::{Decay, LowPass};
use super::magnetic::{FieldJudge, FieldTable};
use super::rest::{REST_TAU_S, RestDetector};
use super::small_angle::{self, Heading, renormalised};
use super::tilt::Tilt;
use crate::Reason;
use crate::checks::accel_unit;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Steps closer to each other than this share use the same coefficients: their error is of that
/// size, while integration always takes the exact step.
const SAME_STEP: f64 = 1e-3;
/// Accelerations of a body beyond this are cut, m/s^2: 8 g, a tenth of a second of which tilts the
/// horizon by 10 degrees. Lower: hard shaking is cut, and its mean with it (35 m/s^2 tilts BROAD's fast
/// trials by degrees); higher: bursts of nonsense that no spike gate sees turn the horizon further.
const REACH_M_S2: f64 = 80.0;
/// Weights of the heading's first corrections never fall below 1/n, so that it is found at once.
const FIRST_WEIGHT: f64 = 1.0;

/// What depends on the time step alone.
#[derive(Clone, Copy, Debug)]
struct StepTable {
    dt_s: f64,
    rate_hz: f64,
    accel: Decay,
    rest: Decay,
    noise: BiasNoise,
}

/// The state.
#[derive(Clone, Debug)]
pub struct InertialFilter {
    config: AttitudeConfig,
    table: StepTable,
    /// The level frame from the body: integrated gyro, and the inclination's corrections.
    levelled: UnitQuaternion<f64>,
    /// The same as a matrix, of the last step.
    rotation: Matrix3<f64>,
    /// Heading of the level frame in the earth frame.
    heading: Heading,
    accel_low_pass: LowPass<3>,
    rest: RestDetector,
    bias: BiasFilter,
    field: FieldJudge,
    field_table: FieldTable,
    first_weight: f64,
    since_mag_s: f64,
}

impl InertialFilter {
    /// Before the first sample.
    pub fn new(config: &AttitudeConfig) -> Self {
        Self {
            config: *config,
            table: table(config, 0.01),
            levelled: UnitQuaternion::identity(),
            rotation: Matrix3::identity(),
            heading: Heading::new(),
            accel_low_pass: LowPass::new(),
            rest: RestDetector::new(),
            bias: BiasFilter::new(config),
            field: FieldJudge::new(),
            field_table: FieldTable::new(config.tau_mag_s, 0.01),
            first_weight: FIRST_WEIGHT,
            since_mag_s: 0.0,
        }
    }

    /// Gyro alone: the other sensors cannot be used. `gyro` with its bias.
    pub fn turn(&mut self, gyro: &Vector3<f64>, dt_s: f64) {
        self.integrate(gyro, dt_s);
        self.rotation = *self.levelled.to_rotation_matrix().matrix();
    }

    #[inline]
    fn integrate(&mut self, gyro: &Vector3<f64>, dt_s: f64) {
        let step = small_angle::turn(&((gyro - self.bias.bias()) * dt_s));
        self.levelled = renormalised(self.levelled.quaternion() * step.quaternion());
        self.since_mag_s += dt_s;
    }

    /// Gyro, rad/s, and accelerometer, m/s^2, of one step. `may_rest` is false where the
    /// accelerometer's unit is doubtful.
    pub fn step(&mut self, gyro: &Vector3<f64>, accel: &Vector3<f64>, may_rest: bool, dt_s: f64) {
        if (dt_s - self.table.dt_s).abs() > SAME_STEP * self.table.dt_s {
            self.table = table(&self.config, dt_s);
        }
        let clip = self.config.bias_clip_rad_s;
        self.rest.step(gyro, accel, clip, dt_s, &self.table.rest);
        self.integrate(gyro, dt_s);
        // The specific force is low-passed in the level frame, whose every turn turns the low-pass
        // with it: that is a low-pass in an inertial frame.
        let now = self.within_reach(self.levelled * accel);
        let force = self
            .accel_low_pass
            .step(&[now.x, now.y, now.z], &self.table.accel);
        let mut tilt = [0.0; 2];
        if let Some((turn, norm)) = Tilt::to_up(&force) {
            let scale = self.table.rate_hz / norm;
            tilt = [-force[1] * scale, force[0] * scale];
            self.levelled = turn.after(&self.levelled);
            self.accel_low_pass
                .replace([0.0, 0.0, norm], |slope| turn.turned(slope));
        }
        self.rotation = *self.levelled.to_rotation_matrix().matrix();
        let at_rest = may_rest && self.rest.is_at_rest();
        self.estimate_bias(tilt, at_rest, clip);
    }

    /// The specific force, level frame, at most [`REACH_M_S2`] off the low-passed one: a burst of
    /// nonsense that no spike gate sees does not turn the horizon at once.
    #[inline]
    fn within_reach(&self, now: Vector3<f64>) -> Vector3<f64> {
        let mean = Vector3::from(*self.accel_low_pass.value());
        let off = now - mean;
        let square = off.norm_squared();
        if square <= REACH_M_S2 * REACH_M_S2 {
            return now;
        }
        mean + off * (REACH_M_S2 / square.sqrt())
    }

    /// `tilt` is the rate at which the inclination was corrected, rad/s.
    fn estimate_bias(&mut self, tilt: [f64; 2], at_rest: bool, clip: f64) {
        let (config, table) = (&self.config, &self.table);
        if !(config.motion_bias || config.rest_bias) {
            return;
        }
        let noise = &table.noise;
        self.bias.grow(noise);
        let seen = config
            .motion_bias
            .then(|| self.bias.follow(&self.rotation, &table.accel));
        if at_rest && config.rest_bias {
            self.bias.at_rest(&self.rest.mean_gyro(), clip, noise);
        } else if let Some(seen) = seen {
            self.bias.in_motion(&seen, tilt, clip, noise);
        }
    }

    /// A magnetometer reading after [`InertialFilter::step`] of the same instant. Readings may come
    /// less often than steps.
    pub fn magnetic(&mut self, mag: &Vector3<f64>) {
        let dt_s = self.since_mag_s;
        let earth = self.rotation * mag;
        let flat2 = earth.x * earth.x + earth.y * earth.y;
        let (norm, flat) = ((flat2 + earth.z * earth.z).sqrt(), flat2.sqrt());
        // Along the vertical a field knows no heading.
        if dt_s <= 0.0 || norm < 1e-12 || flat < 1e-9 * norm {
            return;
        }
        self.since_mag_s = 0.0;
        if (dt_s - self.field_table.dt_s).abs() > SAME_STEP * self.field_table.dt_s {
            self.field_table = FieldTable::new(self.config.tau_mag_s, dt_s);
        }
        let mut weight = 1.0;
        if self.config.reject_disturbance {
            let (turning, table) = (self.rest.mean_gyro(), &self.field_table);
            self.field.step(norm, flat, -earth.z, &turning, dt_s, table);
            weight = self.field.weight(dt_s);
        }
        let mut share = self.field_table.heading * weight;
        if self.first_weight > 0.0 {
            share = share.max(self.first_weight);
            self.first_weight /= self.first_weight + 1.0;
            if self.first_weight * self.config.tau_mag_s < dt_s {
                self.first_weight = 0.0;
            }
        }
        if share > 0.0 {
            let off = self.heading.off_north(earth.x, earth.y, flat);
            self.heading.turn(share * off);
        }
    }

    /// After a gap the low-passes begin anew and the heading is found at once.
    pub fn restart(&mut self) {
        self.accel_low_pass = LowPass::new();
        self.rest = RestDetector::new();
        self.first_weight = FIRST_WEIGHT;
    }

    /// Earth (east, north, up) from body.
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        self.heading.after(&self.levelled)
    }

    /// The gyro's bias, rad/s.
    pub fn bias(&self) -> Vector3<f64> {
        self.bias.bias()
    }

    /// True at rest.
    pub fn is_at_rest(&self) -> bool {
        self.rest.is_at_rest()
    }

    /// What the accelerometer's mean says of its unit, once known.
    #[inline]
    pub fn accel_unit(&self) -> Option<Reason> {
        let known = self.rest.is_settled();
        known.then(|| accel_unit(&self.rest.mean_accel())).flatten()
    }

    /// True where the field is not the one that is believed.
    pub fn is_disturbed(&self) -> bool {
        self.config.reject_disturbance && self.field.is_disturbed()
    }
}

fn table(config: &AttitudeConfig, dt_s: f64) -> StepTable {
    StepTable {
        dt_s,
        rate_hz: 1.0 / dt_s,
        accel: Decay::new(config.tau_accel_s, dt_s),
        rest: Decay::new(REST_TAU_S, dt_s),
        noise: BiasNoise::new(config, dt_s),
    }
}
