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
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use sphereflow_sphere::lie::so3;
use std::f64::consts::{PI, TAU};

/// Steps closer to each other than this share use the same coefficients: their error is of that
/// size, while integration always takes the exact step.
const SAME_STEP: f64 = 1e-3;
/// Weights of the heading's first corrections never fall below 1/n, so that it is found at once.
const FIRST_WEIGHT: f64 = 1.0;

/// What depends on the time step alone.
#[derive(Clone, Copy, Debug)]
struct StepTable {
    dt_s: f64,
    accel: Decay,
    rest: Decay,
    noise: BiasNoise,
}

/// The state.
#[derive(Clone, Debug)]
pub struct InertialFilter {
    config: AttitudeConfig,
    table: StepTable,
    /// Integrated gyro: an inertial frame from the body.
    strapdown: UnitQuaternion<f64>,
    /// The correction of the inclination: level frame from the inertial one.
    level: UnitQuaternion<f64>,
    /// Both: the level frame from the body.
    levelled: UnitQuaternion<f64>,
    /// Heading of the level frame in the earth frame, rad.
    heading: f64,
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
            strapdown: UnitQuaternion::identity(),
            level: UnitQuaternion::identity(),
            levelled: UnitQuaternion::identity(),
            heading: 0.0,
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
        let step = small_turn(&((gyro - self.bias.bias()) * dt_s));
        self.strapdown = renormalised(self.strapdown.quaternion() * step.quaternion());
        self.levelled = self.level * self.strapdown;
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
        self.turn(gyro, dt_s);
        let inertial = self.strapdown * accel;
        let smooth = self
            .accel_low_pass
            .step(&[inertial.x, inertial.y, inertial.z], &self.table.accel);
        let smooth = Vector3::from(smooth);
        let norm = smooth.norm();
        let up = if norm > 1e-9 {
            self.level * smooth / norm
        } else {
            Vector3::z()
        };
        self.level = renormalised(tilt_to_up(&up).into_inner() * self.level.quaternion());
        self.levelled = self.level * self.strapdown;
        let at_rest = may_rest && self.rest.is_at_rest();
        self.estimate_bias(&up, at_rest, clip, dt_s);
    }

    fn estimate_bias(&mut self, up: &Vector3<f64>, at_rest: bool, clip: f64, dt_s: f64) {
        let (config, table) = (&self.config, &self.table);
        if !(config.motion_bias || config.rest_bias) {
            return;
        }
        let noise = &table.noise;
        self.bias.grow(noise);
        if config.motion_bias {
            let rotation = self.levelled.to_rotation_matrix();
            self.bias.follow(rotation.matrix(), &table.accel);
        }
        if at_rest && config.rest_bias {
            self.bias.at_rest(&self.rest.mean_gyro(), clip, noise);
        } else if config.motion_bias {
            self.bias
                .in_motion([-up.y / dt_s, up.x / dt_s], clip, noise);
        }
    }

    /// A magnetometer reading after [`InertialFilter::step`] of the same instant. Readings may come
    /// less often than steps.
    pub fn magnetic(&mut self, mag: &Vector3<f64>) {
        let dt_s = self.since_mag_s;
        let earth = self.levelled * mag;
        if dt_s <= 0.0 || earth.norm() < 1e-12 {
            return;
        }
        self.since_mag_s = 0.0;
        if (dt_s - self.field_table.dt_s).abs() > SAME_STEP * self.field_table.dt_s {
            self.field_table = FieldTable::new(self.config.tau_mag_s, dt_s);
        }
        let mut weight = 1.0;
        if self.config.reject_disturbance {
            self.field.step(
                &earth,
                self.rest.mean_gyro().norm(),
                dt_s,
                &self.field_table,
            );
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
        let disagreement = wrapped(earth.x.atan2(earth.y) - self.heading);
        self.heading = wrapped(self.heading + share * disagreement);
    }

    /// After a gap the low-passes begin anew and the heading is found at once.
    pub fn restart(&mut self) {
        self.accel_low_pass = LowPass::new();
        self.rest = RestDetector::new();
        self.first_weight = FIRST_WEIGHT;
    }

    /// Earth (east, north, up) from body.
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        let (sin, cos) = (0.5 * self.heading).sin_cos();
        let heading = Quaternion::new(cos, 0.0, 0.0, sin);
        renormalised(heading * self.levelled.quaternion())
    }

    /// The gyro's bias and its standard deviation, rad/s.
    pub fn bias(&self) -> (Vector3<f64>, Vector3<f64>) {
        (self.bias.bias(), self.bias.sigma())
    }

    /// True at rest.
    pub fn is_at_rest(&self) -> bool {
        self.rest.is_at_rest()
    }

    /// Mean norm of the accelerometer, once known.
    pub fn mean_accel(&self) -> Option<f64> {
        self.rest.is_settled().then(|| self.rest.mean_accel())
    }

    /// True where the field is not the one that is believed.
    pub fn is_disturbed(&self) -> bool {
        self.config.reject_disturbance && self.field.is_disturbed()
    }
}

fn table(config: &AttitudeConfig, dt_s: f64) -> StepTable {
    StepTable {
        dt_s,
        accel: Decay::new(config.tau_accel_s, dt_s),
        rest: Decay::new(REST_TAU_S, dt_s),
        noise: BiasNoise::new(config, dt_s),
    }
}

/// The smallest rotation that carries the unit vector `up` to z.
fn tilt_to_up(up: &Vector3<f64>) -> UnitQuaternion<f64> {
    let scalar = (0.5 * (up.z + 1.0)).max(0.0).sqrt();
    if scalar <= 1e-6 {
        return UnitQuaternion::new_unchecked(Quaternion::new(0.0, 1.0, 0.0, 0.0));
    }
    let (x, y) = (0.5 * up.y / scalar, -0.5 * up.x / scalar);
    UnitQuaternion::new_unchecked(Quaternion::new(scalar, x, y, 0.0))
}

/// The rotation of a rotation vector, quick where it is small: the series of sine and cosine to
/// rounding below 0.2 rad.
fn small_turn(vector: &Vector3<f64>) -> UnitQuaternion<f64> {
    let h2 = 0.25 * vector.norm_squared();
    if h2 > 0.01 {
        return so3::exp(vector);
    }
    let sinc = 1.0 - h2 / 6.0 * (1.0 - h2 / 20.0 * (1.0 - h2 / 42.0 * (1.0 - h2 / 72.0)));
    let cos = 1.0 - h2 / 2.0 * (1.0 - h2 / 12.0 * (1.0 - h2 / 30.0 * (1.0 - h2 / 56.0)));
    UnitQuaternion::new_unchecked(Quaternion::from_parts(cos, vector * (0.5 * sinc)))
}

/// One Newton step for the norm, which stays within rounding of 1.
fn renormalised(q: Quaternion<f64>) -> UnitQuaternion<f64> {
    let square = q.norm_squared();
    if (square - 1.0).abs() < 1e-4 {
        UnitQuaternion::new_unchecked(q * (1.5 - 0.5 * square))
    } else {
        UnitQuaternion::from_quaternion(q)
    }
}

/// To (-pi, pi].
fn wrapped(angle: f64) -> f64 {
    if angle > PI {
        angle - TAU
    } else if angle <= -PI {
        angle + TAU
    } else {
        angle
    }
}
