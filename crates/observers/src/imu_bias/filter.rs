//! The estimator of IMU biases: samples in, biases, gravity and velocity with a status out.

mod measure;

use super::VelocityMeasurement;
use super::config::{ImuBiasConfig, ImuBiasMethod};
use super::field::FieldCheck;
use super::kalman::{Kalman, Matrix12};
use super::kinematics::Kinematics;
use super::observability::{Excitation, ObserverProgress};
use crate::checks::Watch;
use crate::limits;
use crate::spikes::{Sieved, SpikeGate};
use crate::{Reason, Result, Sensor, Status};
use nalgebra::Vector3;
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
    progress: ObserverProgress,
    started: bool,
    watch: Watch,
    /// Of gyro and accelerometer.
    gates: [SpikeGate; 2],
    refused: u64,
    /// So many velocities in a row have disagreed, and did so before they were believed.
    disagreed: usize,
    lost_before: bool,
    fields: FieldCheck,
    since_velocity_s: f64,
    since_field_s: f64,
    /// Integrals of gyro and velocity since the last velocity, for images that measure means.
    turned: Vector3<f64>,
    travelled: Vector3<f64>,
    /// The gyro's bias as last measured: the observer turns gravity with it.
    measured_bias: Option<Vector3<f64>>,
    blind: usize,
    settling_s: Option<f64>,
    /// The readings before: a step integrates the mean of those at its two ends.
    last: Option<[Vector3<f64>; 2]>,
    status: Status,
}

/// So many velocities in a row that are gated are right.
const PATIENCE: usize = 10;
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
            progress: ObserverProgress::default(),
            started: false,
            watch: Watch::new(config.gyro_limit_rad_s),
            gates: [SpikeGate::gyro(), SpikeGate::accel()],
            refused: 0,
            disagreed: 0,
            lost_before: false,
            fields: FieldCheck::default(),
            since_velocity_s: 0.0,
            since_field_s: 0.0,
            turned: Vector3::zeros(),
            travelled: Vector3::zeros(),
            measured_bias: None,
            blind: 3,
            settling_s: None,
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
        if !limits::is_step(dt_s) {
            return Status::Skipped(Reason::StampNotIncreasing);
        }
        let (saturated, sieved) = self.sieve(gyro, accel, dt_s);
        let late = match sieved {
            Ok(late) => late,
            Err(_) if saturated => {
                self.lose_motion();
                return self.judge();
            }
            Err(reason) => {
                self.hold(dt_s);
                return Status::Skipped(reason);
            }
        };
        self.start(accel, velocity);
        let gap = (dt_s > self.config.max_gap_s).then_some(Reason::Gap { seconds: dt_s });
        if let Some(reason) = gap {
            self.watch.remember(reason);
        }
        if saturated || gap.is_some() {
            self.kalman.wander(&self.config, dt_s);
            self.lose_motion();
            self.last = Some([*gyro, *accel]);
            return self.judge();
        }
        let [earlier_gyro, earlier_accel] = self
            .last
            .replace([*gyro, *accel])
            .unwrap_or([*gyro, *accel]);
        let [late_gyro, late_accel] = late;
        self.predict(
            &((gyro + earlier_gyro) * 0.5 + late_gyro),
            &((accel + earlier_accel) * 0.5 + late_accel),
            dt_s,
        );
        let (field, disturbed) = self.field(mag);
        let omega = gyro - self.kalman.x.gyro_bias;
        self.excitation.push(&omega, field.as_ref(), dt_s);
        if self.config.method == ImuBiasMethod::Observer {
            self.progress.push(&omega, field.as_ref(), dt_s);
        }
        let gated = field.and_then(|field| self.use_field(&field));
        let used = velocity.map_or(Ok(()), |velocity| {
            let outcome = self.use_velocity(velocity);
            self.lose_patience(outcome);
            outcome
        });
        match used.err().or(disturbed).or(gated) {
            // A sensor with a flaw is the cause, a gate only what follows from it.
            Some(Reason::Gated { .. }) if self.watch.flaw().is_some() => self.judge(),
            Some(reason) => Status::Weak(reason),
            None => self.judge(),
        }
    }

    /// True where the gyro is at its limit; and the mean rates that were held back in vain, or why
    /// the readings are not used.
    fn sieve(
        &mut self,
        gyro: &Vector3<f64>,
        accel: &Vector3<f64>,
        dt_s: f64,
    ) -> (bool, std::result::Result<[Vector3<f64>; 2], Reason>) {
        let possible = limits::refused(Sensor::Gyro, gyro, limits::GYRO_RAD_S).is_none()
            && limits::refused(Sensor::Accel, accel, limits::ACCEL_M_S2).is_none();
        let saturated = possible && self.watch.step(gyro, Some(accel), dt_s);
        let mut late = Ok([Vector3::zeros(); 2]);
        for (i, reading) in [gyro, accel].into_iter().enumerate() {
            match (self.gates[i].step(reading, dt_s), &mut late) {
                (Sieved::Refused(reason), _) => late = Err(reason),
                // Both steps took the mean with the reading held in its place.
                (Sieved::Late(off, held_s), Ok(late)) => {
                    late[i] = off * (0.5 * (held_s + dt_s) / dt_s);
                }
                _ => (),
            }
        }
        (saturated, late)
    }

    /// Readings and velocities refused so far: numbers that nothing measures, and spikes. Velocities
    /// that the state does not explain are not among them.
    pub fn refused(&self) -> u64 {
        self.refused + self.gates.iter().map(SpikeGate::refused).sum::<u64>()
    }

    /// Velocities that are gated for long are right.
    fn lose_patience(&mut self, outcome: std::result::Result<(), Reason>) {
        self.disagreed = match outcome {
            Err(Reason::Gated { .. }) => self.disagreed + 1,
            Err(_) => self.disagreed,
            Ok(()) => 0,
        };
        if outcome.is_ok() {
            self.lost_before = false;
        }
        if self.disagreed > PATIENCE {
            self.disagreed = 0;
            // Velocity and gravity first; the biases where that did not help.
            if std::mem::replace(&mut self.lost_before, true) {
                self.kalman.doubt(&self.config);
            }
            self.forget_motion();
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
        self.progress.lose_motion();
        self.forget_motion();
    }

    fn forget_motion(&mut self) {
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
        if let Some(velocity) = velocity.filter(|v| v.refused().is_none()) {
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
        match (self.blind, self.settling_s) {
            (0, None) => Status::Ok,
            (0, Some(seconds)) => Status::Starting(Reason::Settling { seconds }),
            (directions, _) => Status::Weak(Reason::Unobservable { directions }),
        }
    }
}
