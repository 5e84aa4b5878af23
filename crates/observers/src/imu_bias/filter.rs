//! The estimator of IMU biases: samples in, biases, gravity and velocity with a status out.

use super::VelocityMeasurement;
use super::config::{ImuBiasConfig, ImuBiasMethod};
use super::field::FieldCheck;
use super::kalman::{Kalman, Matrix12};
use super::kinematics::Kinematics;
use super::observability::Excitation;
use crate::checks::{Watch, is_finite};
use crate::{Reason, Result, Sensor, Status};
use nalgebra::{Matrix3, Vector3};
use sphereflow_sphere::lie::so3;

/// What is told after each sample, body frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuBiasState {
    /// m/s.
    pub velocity_m_s: Vector3<f64>,
    /// Gravity itself, downwards, m/s^2.
    pub gravity_m_s2: Vector3<f64>,
    /// To be subtracted from the gyro, rad/s.
    pub gyro_bias_rad_s: Vector3<f64>,
    /// To be subtracted from the accelerometer, m/s^2.
    pub accel_bias_m_s2: Vector3<f64>,
    /// Covariance in the order above; the observer has none.
    pub covariance: Option<Matrix12>,
    /// What became of the sample.
    pub status: Status,
}

/// Estimates biases of gyro and accelerometer, gravity and velocity.
#[derive(Clone, Debug)]
pub struct ImuBiasEstimator {
    pub(super) config: ImuBiasConfig,
    pub(super) kalman: Kalman,
    excitation: Excitation,
    started: bool,
    watch: Watch,
    fields: FieldCheck,
    since_velocity_s: f64,
    since_field_s: f64,
    /// Integrals of gyro and velocity since the last velocity, for images that measure means.
    turned: Vector3<f64>,
    travelled: Vector3<f64>,
    /// The gyro's bias as last measured: the observer turns gravity with it.
    measured_bias: Option<Vector3<f64>>,
    blind: usize,
    /// The readings before: a step integrates the mean of those at its two ends.
    last: Option<[Vector3<f64>; 2]>,
    status: Status,
}

/// Without a velocity for so long the state coasts, seconds.
const COASTING_S: f64 = 1.0;

impl ImuBiasEstimator {
    /// # Errors
    /// A value error naming the setting out of range.
    pub fn new(config: ImuBiasConfig) -> Result<Self> {
        config.check()?;
        Ok(Self {
            config,
            kalman: Kalman::new(&config, Kinematics::default()),
            excitation: Excitation::default(),
            started: false,
            watch: Watch::new(config.gyro_limit_rad_s),
            fields: FieldCheck::default(),
            since_velocity_s: 0.0,
            since_field_s: 0.0,
            turned: Vector3::zeros(),
            travelled: Vector3::zeros(),
            measured_bias: None,
            blind: 3,
            last: None,
            status: Status::Starting(Reason::NoData),
        })
    }

    /// The settings.
    pub fn config(&self) -> &ImuBiasConfig {
        &self.config
    }

    /// The motion's excitation so far. Thesis: Proposition 7.
    pub fn excitation(&self) -> &Excitation {
        &self.excitation
    }

    /// One sample, `dt_s` seconds after the one before: gyro, rad/s, accelerometer, m/s^2, and the
    /// velocity and the field (any unit) where there are readings, all of the same instant.
    pub fn step(
        &mut self,
        gyro: &Vector3<f64>,
        accel: &Vector3<f64>,
        velocity: Option<&VelocityMeasurement>,
        mag: Option<&Vector3<f64>>,
        dt_s: f64,
    ) -> ImuBiasState {
        self.status = self.advance(gyro, accel, velocity, mag, dt_s);
        self.state()
    }

    /// The state after the last sample.
    pub fn state(&self) -> ImuBiasState {
        let x = &self.kalman.x;
        ImuBiasState {
            velocity_m_s: x.velocity,
            gravity_m_s2: x.gravity,
            gyro_bias_rad_s: x.gyro_bias,
            accel_bias_m_s2: x.accel_bias,
            covariance: (self.config.method == ImuBiasMethod::Ekf)
                .then_some(self.kalman.covariance),
            status: self.status,
        }
    }

    fn advance(
        &mut self,
        gyro: &Vector3<f64>,
        accel: &Vector3<f64>,
        velocity: Option<&VelocityMeasurement>,
        mag: Option<&Vector3<f64>>,
        dt_s: f64,
    ) -> Status {
        if !(dt_s > 0.0 && dt_s.is_finite()) {
            return Status::Skipped(Reason::StampNotIncreasing);
        }
        for (sensor, v) in [(Sensor::Gyro, gyro), (Sensor::Accel, accel)] {
            if !is_finite(v) {
                self.hold(dt_s);
                return Status::Skipped(Reason::NotFinite { sensor });
            }
        }
        self.start(accel, velocity);
        let saturated = self.watch.step(gyro, Some(accel), dt_s);
        let gap = (dt_s > self.config.max_gap_s).then_some(Reason::Gap { seconds: dt_s });
        if let Some(reason) = gap {
            self.watch.remember(reason);
        }
        if saturated || gap.is_some() {
            self.lose_motion();
            self.last = Some([*gyro, *accel]);
            return self.judge();
        }
        let [earlier_gyro, earlier_accel] = self
            .last
            .replace([*gyro, *accel])
            .unwrap_or([*gyro, *accel]);
        self.predict(
            &((gyro + earlier_gyro) * 0.5),
            &((accel + earlier_accel) * 0.5),
            dt_s,
        );
        let (field, disturbed) = self.field(mag);
        let omega = gyro - self.kalman.x.gyro_bias;
        self.excitation.push(&omega, field.as_ref(), dt_s);
        if let Some(field) = field {
            self.use_field(&field);
        }
        let used = velocity.map_or(Ok(()), |velocity| self.use_velocity(velocity));
        match used.err().or(disturbed) {
            // A sensor with a flaw is the cause, a gate only what follows from it.
            Some(Reason::Gated { .. }) if self.watch.flaw().is_some() => self.judge(),
            Some(reason) => Status::Weak(reason),
            None => self.judge(),
        }
    }

    /// Time passes without a reading: the best guess is the last one.
    fn hold(&mut self, dt_s: f64) {
        match self.last {
            Some([gyro, accel]) if dt_s <= self.config.max_gap_s => {
                self.predict(&gyro, &accel, dt_s);
            }
            _ => self.lose_motion(),
        }
    }

    /// The turn since the sample before is unknown, and with it velocity and gravity. The observer,
    /// which has no covariance to grow, begins with both anew.
    fn lose_motion(&mut self) {
        self.kalman.forget_motion();
        self.begin_interval();
        self.started = self.config.method == ImuBiasMethod::Ekf && self.started;
    }

    /// Gravity at the start: against the specific force.
    fn start(&mut self, accel: &Vector3<f64>, velocity: Option<&VelocityMeasurement>) {
        if self.started || accel.norm() < 1e-3 {
            return;
        }
        self.started = true;
        self.kalman.x.gravity = -accel.normalize() * self.config.gravity_m_s2;
        if let Some(velocity) = velocity.filter(|v| v.is_finite()) {
            self.kalman.x.velocity = velocity.linear_m_s;
        }
    }

    fn predict(&mut self, gyro: &Vector3<f64>, accel: &Vector3<f64>, dt_s: f64) {
        let before = self.kalman.x.velocity;
        match self.config.method {
            ImuBiasMethod::Ekf => self.kalman.predict(&self.config, gyro, accel, dt_s),
            ImuBiasMethod::Observer => {
                let x = &mut self.kalman.x;
                let turning = gyro - self.measured_bias.unwrap_or(x.gyro_bias);
                x.step_with(gyro, accel, &so3::exp(&(turning * -dt_s)), dt_s);
            }
        }
        self.turned += gyro * dt_s;
        self.travelled += (before + self.kalman.x.velocity) * (0.5 * dt_s);
        self.since_velocity_s += dt_s;
        self.since_field_s += dt_s;
    }

    /// The unit field where there is one to use, and why not.
    fn field(&mut self, mag: Option<&Vector3<f64>>) -> (Option<Vector3<f64>>, Option<Reason>) {
        let (Some(mag), Some(dot)) = (mag, self.config.field_dot_down) else {
            return (None, None);
        };
        let down = self.kalman.x.gravity / self.config.gravity_m_s2;
        match self.fields.judge(mag, &down, dot, self.since_field_s) {
            Ok(field) => (Some(field), None),
            Err(reason) => {
                self.since_field_s = 0.0;
                (None, Some(reason))
            }
        }
    }

    /// `b . g = B . G`. Thesis: section 7.1.
    fn use_field(&mut self, field: &Vector3<f64>) {
        let config = &self.config;
        let product = config.field_dot_down.unwrap_or_default() * config.gravity_m_s2;
        match config.method {
            ImuBiasMethod::Ekf => {
                let residual = product - field.dot(&self.kalman.x.gravity);
                let variance = (config.field_sigma * config.gravity_m_s2).powi(2);
                self.kalman.update_gravity(field, residual, variance);
            }
            ImuBiasMethod::Observer => {
                let gains = &config.gains;
                gains.correct_field(&mut self.kalman.x, field, product, self.since_field_s);
            }
        }
        self.since_field_s = 0.0;
    }

    fn use_velocity(&mut self, velocity: &VelocityMeasurement) -> std::result::Result<(), Reason> {
        if !velocity.is_finite() {
            return Err(Reason::NotFinite {
                sensor: Sensor::Velocity,
            });
        }
        let since_s = self.since_velocity_s;
        let now = self.last.map_or_else(Vector3::zeros, |[gyro, _]| gyro);
        let rate = if velocity.is_mean_angular {
            self.turned / since_s
        } else {
            now
        };
        let speed = if velocity.is_mean {
            self.travelled / since_s
        } else {
            self.kalman.x.velocity
        };
        let error = speed - velocity.linear_m_s;
        let bias = velocity.angular_rad_s.map(|omega| rate - omega);
        let outcome = match self.config.method {
            ImuBiasMethod::Ekf => self.kalman_velocity(velocity, &-error, bias.as_ref()),
            ImuBiasMethod::Observer => {
                let gains = self.config.gains;
                gains.correct(&mut self.kalman.x, &error, bias.as_ref(), since_s);
                self.measured_bias = bias;
                Ok(())
            }
        };
        self.begin_interval();
        self.blind = self.excitation.blind_count();
        outcome
    }

    fn kalman_velocity(
        &mut self,
        velocity: &VelocityMeasurement,
        residual: &Vector3<f64>,
        bias: Option<&Vector3<f64>>,
    ) -> std::result::Result<(), Reason> {
        let gate = self.config.gate;
        let gated = |distance: f64| Reason::Gated {
            sensor: Sensor::Velocity,
            distance,
            limit: gate,
        };
        let config = self.config;
        self.kalman.update_norm(&config, self.since_velocity_s);
        self.kalman
            .update3(0, residual, &velocity.linear_covariance, gate)
            .map_err(gated)?;
        if let Some(bias) = bias {
            let gyro2 = self.config.gyro_sigma_rad_s.powi(2);
            let noise = velocity.angular_covariance + Matrix3::identity() * gyro2;
            let residual = bias - self.kalman.x.gyro_bias;
            self.kalman
                .update3(6, &residual, &noise, gate)
                .map_err(gated)?;
        }
        Ok(())
    }

    fn begin_interval(&mut self) {
        (self.turned, self.travelled) = (Vector3::zeros(), Vector3::zeros());
        self.since_velocity_s = 0.0;
    }

    fn judge(&self) -> Status {
        if let Some(reason) = self.watch.flaw() {
            return Status::Weak(reason);
        }
        if self.since_velocity_s > COASTING_S {
            let seconds = self.since_velocity_s;
            return Status::Weak(Reason::Coasting { seconds });
        }
        match self.blind {
            0 => Status::Ok,
            directions => Status::Weak(Reason::Unobservable { directions }),
        }
    }
}
