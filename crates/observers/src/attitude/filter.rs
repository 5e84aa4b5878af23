//! The attitude filter: samples in, attitude with a status out, whichever estimator works inside.

use super::config::{AttitudeConfig, Method, World};
use super::inertial::InertialFilter;
use super::invariant::InvariantObserver;
use crate::checks::{self, DeadAxis};
use crate::limits;
use crate::spikes::{Sieved, SpikeGate};
use crate::{Reason, Result, Sensor, Status};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// What is told after each sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttitudeState {
    /// Attitude, in the world that was asked for.
    pub world_from_body: UnitQuaternion<f64>,
    /// To be subtracted from the gyro's readings, rad/s, body frame.
    pub gyro_bias_rad_s: Vector3<f64>,
    /// What became of the sample.
    pub status: Status,
    /// True where neither gyro nor accelerometer moves.
    pub at_rest: bool,
    /// True where the magnetic field is left out as disturbed.
    pub mag_disturbed: bool,
}

/// Attitude and gyro bias from gyro, accelerometer and, where there is one, magnetometer.
#[derive(Clone, Debug)]
pub struct AttitudeFilter {
    config: AttitudeConfig,
    estimator: Estimator,
    gyro_axes: DeadAxis,
    accel_axes: DeadAxis,
    gates: [SpikeGate; 2],
    refused_fields: u64,
    last_gyro: Vector3<f64>,
    time_s: f64,
    last_mag_s: Option<f64>,
    /// A flaw that the state has not got over yet, and until when.
    lasting: Option<(Reason, f64)>,
    used: bool,
    status: Status,
}

#[derive(Clone, Debug)]
enum Estimator {
    Inertial(Box<InertialFilter>),
    Invariant(Box<InvariantObserver>),
}

/// A heading without a magnetic reading for so long is said to drift, seconds.
const HEADING_S: f64 = 10.0;
/// A turn in a gap is guessed for so long, seconds: after that the body has turned elsewhere.
const GUESSED_S: f64 = 2.0;
/// The filter settles within so many time constants of its slowest part.
const SETTLING: f64 = 1.0;

impl AttitudeFilter {
    /// # Errors
    /// A value error naming the setting out of range.
    pub fn new(config: AttitudeConfig) -> Result<Self> {
        config.check()?;
        let estimator = match config.method {
            Method::Inertial => Estimator::Inertial(Box::new(InertialFilter::new(&config))),
            Method::Invariant => Estimator::Invariant(Box::new(InvariantObserver::new(&config))),
        };
        Ok(Self {
            config,
            estimator,
            gyro_axes: DeadAxis::new(),
            accel_axes: DeadAxis::new(),
            gates: [SpikeGate::gyro(), SpikeGate::accel()],
            refused_fields: 0,
            last_gyro: Vector3::zeros(),
            time_s: 0.0,
            last_mag_s: None,
            lasting: None,
            used: false,
            status: Status::Starting(Reason::NoData),
        })
    }

    /// The settings.
    pub fn config(&self) -> &AttitudeConfig {
        &self.config
    }

    /// One sample, body frame: `gyro` in rad/s, `accel` in m/s^2 (specific force), `mag` in
    /// microtesla where there is one, `dt_s` after the sample before. The first sample's step only
    /// sets the scale of time: give the sampling period.
    pub fn step(
        &mut self,
        gyro: &Vector3<f64>,
        accel: &Vector3<f64>,
        mag: Option<&Vector3<f64>>,
        dt_s: f64,
    ) -> AttitudeState {
        self.status = self.advance(gyro, accel, mag, dt_s);
        self.state()
    }

    /// Readings left out so far because no sensor reads such numbers, or because they were spikes.
    pub fn refused(&self) -> u64 {
        self.refused_fields + self.gates.iter().map(SpikeGate::refused).sum::<u64>()
    }

    /// The state after the last sample.
    pub fn state(&self) -> AttitudeState {
        let (earth_from_body, bias, at_rest, disturbed) = match &self.estimator {
            Estimator::Inertial(f) => (f.rotation(), f.bias(), f.is_at_rest(), f.is_disturbed()),
            Estimator::Invariant(f) => (f.rotation(), f.bias(), f.is_at_rest(), f.is_disturbed()),
        };
        AttitudeState {
            world_from_body: in_world(&earth_from_body, self.config.world),
            gyro_bias_rad_s: bias,
            status: self.status,
            at_rest,
            mag_disturbed: disturbed,
        }
    }

    fn advance(
        &mut self,
        gyro: &Vector3<f64>,
        accel: &Vector3<f64>,
        mag: Option<&Vector3<f64>>,
        dt_s: f64,
    ) -> Status {
        if !limits::is_step(dt_s) {
            return Status::Skipped(Reason::StampNotIncreasing);
        }
        self.time_s += dt_s;
        let saturated = self.saturated(gyro);
        let mut turning = *gyro;
        match self.gates[0].step(gyro, dt_s) {
            Sieved::Refused(reason) => {
                // The best guess of an unknown rate is the last one.
                let held = self.last_gyro;
                self.turn(&held, dt_s.min(self.config.max_gap_s));
                return saturated.map_or(Status::Skipped(reason), Status::Weak);
            }
            Sieved::Late(off, held_s) => turning += off * (held_s / dt_s),
            Sieved::Good => (),
        }
        if dt_s > self.config.max_gap_s {
            return self.gap(gyro, dt_s);
        }
        self.last_gyro = *gyro;
        if let Sieved::Refused(reason) = self.gates[1].step(accel, dt_s) {
            self.turn(&turning, dt_s);
            return Status::Weak(reason);
        }
        let bad_mag = mag.and_then(limits::refused_field);
        self.refused_fields += u64::from(bad_mag.is_some());
        let usable = if bad_mag.is_some() { None } else { mag };
        self.estimate(&turning, accel, usable, dt_s);
        self.used = true;
        let dead = self.dead_axis(gyro, accel, dt_s);
        self.judge(dead, bad_mag)
    }

    /// A gyro at its limit is remembered until the heading has been found again.
    fn saturated(&mut self, gyro: &Vector3<f64>) -> Option<Reason> {
        let in_range = limits::refused(Sensor::Gyro, gyro, limits::GYRO_RAD_S).is_none();
        let reason = checks::saturated(gyro, self.config.gyro_limit_rad_s).filter(|_| in_range)?;
        self.lasting = Some((reason, self.time_s + self.config.tau_mag_s));
        Some(reason)
    }

    fn turn(&mut self, gyro: &Vector3<f64>, dt_s: f64) {
        match &mut self.estimator {
            Estimator::Inertial(f) => f.turn(gyro, dt_s),
            Estimator::Invariant(f) => f.turn(gyro, dt_s),
        }
    }

    /// After a gap the turn in it is unknown: the mean rate is the guess for a while, and the
    /// inclination and the heading are sought anew.
    fn gap(&mut self, gyro: &Vector3<f64>, dt_s: f64) -> Status {
        if self.used {
            let rate = (self.last_gyro + gyro) * 0.5;
            self.turn(&rate, dt_s.min(GUESSED_S));
        }
        if let Estimator::Inertial(f) = &mut self.estimator {
            f.restart();
        }
        let reason = Reason::Gap { seconds: dt_s };
        self.lasting = Some((reason, self.time_s + self.config.tau_accel_s));
        self.last_gyro = *gyro;
        Status::Weak(reason)
    }

    fn estimate(
        &mut self,
        gyro: &Vector3<f64>,
        accel: &Vector3<f64>,
        mag: Option<&Vector3<f64>>,
        dt_s: f64,
    ) {
        match &mut self.estimator {
            Estimator::Inertial(f) => {
                let may_rest = f.accel_unit().is_none();
                f.step(gyro, accel, may_rest, dt_s);
                if let Some(mag) = mag {
                    f.magnetic(mag);
                }
            }
            Estimator::Invariant(f) => f.step(gyro, accel, mag, dt_s),
        }
        if mag.is_some() {
            self.last_mag_s = Some(self.time_s);
        }
    }

    fn dead_axis(
        &mut self,
        gyro: &Vector3<f64>,
        accel: &Vector3<f64>,
        dt_s: f64,
    ) -> Option<Reason> {
        let gyro = self
            .gyro_axes
            .step(gyro, dt_s)
            .map(|axis| (Sensor::Gyro, axis));
        let accel = self
            .accel_axes
            .step(accel, dt_s)
            .map(|axis| (Sensor::Accel, axis));
        let (sensor, axis) = gyro.or(accel)?;
        Some(Reason::DeadAxis { sensor, axis })
    }

    /// The worst that is to be said of the state.
    fn judge(&mut self, dead: Option<Reason>, bad_mag: Option<Reason>) -> Status {
        if let Some(reason) = dead {
            return Status::Weak(reason);
        }
        if let Some((reason, until_s)) = self.lasting {
            if self.time_s < until_s {
                return Status::Weak(reason);
            }
            self.lasting = None;
        }
        let (unit, disturbed) = match &self.estimator {
            Estimator::Inertial(f) => (f.accel_unit(), f.is_disturbed()),
            Estimator::Invariant(f) => (f.accel_unit(), f.is_disturbed()),
        };
        if let Some(reason) = unit {
            return Status::Weak(reason);
        }
        if disturbed {
            return Status::Weak(Reason::MagneticDisturbance);
        }
        if let Some(reason) = bad_mag {
            return Status::Weak(reason);
        }
        let seconds = SETTLING * self.config.tau_accel_s - self.time_s;
        if seconds > 0.0 {
            return Status::Starting(Reason::Settling { seconds });
        }
        match self.last_mag_s {
            Some(last) if self.time_s - last < HEADING_S => Status::Ok,
            _ => Status::Weak(Reason::NoMagnetometer),
        }
    }
}

/// From the earth frame to the world that was asked for.
fn in_world(earth_from_body: &UnitQuaternion<f64>, world: World) -> UnitQuaternion<f64> {
    match world {
        World::EastNorthUp => *earth_from_body,
        World::RightDownForward => {
            // x = east, y = -up, z = north: a turn by +90 degrees about x.
            let half = std::f64::consts::FRAC_1_SQRT_2;
            let turn = Quaternion::new(half, half, 0.0, 0.0);
            UnitQuaternion::from_quaternion(turn * earth_from_body.quaternion())
        }
    }
}
