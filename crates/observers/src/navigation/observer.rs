//! The thesis's observer of velocity and position.
//!
//! Thesis: eq. (9.5), with gravity added: `v' = v x omega_m + a_m + q* G q + ...`, G = (0, +9.81, 0)
//! with y down. As printed (`- q* A q`) it stands 1 m and 4 m/s off.

use super::config::NavigationConfig;
use crate::checks::{Watch, is_finite};
use crate::limits;
use crate::spikes::{Sieved, SpikeGate};
use crate::{Reason, Result, Sensor, Status};
use nalgebra::{UnitQuaternion, Vector3};
use sphereflow_core::checks;
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
#[derive(Clone, Copy, Debug)]
pub struct PositionObserver {
    gains: PositionGains,
    gravity: Vector3<f64>,
    velocity: Vector3<f64>,
    position: Vector3<f64>,
    /// The readings before, for those that are not finite.
    last: Option<[Vector3<f64>; 2]>,
    watch: Watch,
    /// Of gyro and accelerometer.
    gates: [SpikeGate; 2],
    refused: u64,
    /// Velocity, position: they have disagreed for so long, seconds.
    disagreed_s: [f64; 2],
    since_measured_s: f64,
    /// The motion since the last sample is unknown: velocity, position.
    lost: [bool; 2],
}

/// A velocity (m/s) or position (m) further than this from the state is left out: a hand's error in
/// a few seconds without any is less. Lower: a poor start waits for the patience; higher: wrong
/// positions pull.
const GATE: f64 = 5.0;
/// What disagrees for so long is right, seconds.
const PATIENCE_S: f64 = 1.0;
/// Longer steps are gaps, seconds.
const MAX_GAP_S: f64 = 0.5;
/// Without velocity and position for longer the answer is said to coast, seconds.
const COASTING_S: f64 = 0.5;

impl PositionObserver {
    /// From the first velocity (body) and position (world). `gravity` is gravity itself in the
    /// world, m/s^2.
    ///
    /// # Errors
    /// A value error naming the gain that is not positive, or the vector that is not finite.
    pub fn new(
        gains: PositionGains,
        gravity: Vector3<f64>,
        velocity: Vector3<f64>,
        position: Vector3<f64>,
    ) -> Result<Self> {
        checks::each(
            checks::positive,
            &[("k_v", gains.k_v), ("k_vx", gains.k_vx), ("k_x", gains.k_x)],
        )?;
        for (name, v) in [
            ("gravity_m_s2", &gravity),
            ("velocity_m_s", &velocity),
            ("position_m", &position),
        ] {
            if !is_finite(v) {
                let found = format!("{:?}", v.as_slice());
                return Err(sphereflow_core::Error::value(name, "finite numbers", found).into());
            }
        }
        Ok(Self {
            gains,
            gravity,
            velocity,
            position,
            last: None,
            watch: Watch::new(NavigationConfig::default().gyro_limit_rad_s),
            gates: [SpikeGate::gyro(), SpikeGate::accel()],
            refused: 0,
            disagreed_s: [0.0; 2],
            since_measured_s: 0.0,
            lost: [false; 2],
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
        if !limits::is_step(dt_s) {
            return Status::Skipped(Reason::StampNotIncreasing);
        }
        let attitude = world_from_body.imag() * world_from_body.w;
        if let Some(reason) = limits::refused(Sensor::Pose, &attitude, 1.0) {
            self.refused += 1;
            return Status::Skipped(reason);
        }
        let possible = limits::refused(Sensor::Gyro, gyro, limits::GYRO_RAD_S).is_none()
            && limits::refused(Sensor::Accel, accel, limits::ACCEL_M_S2).is_none();
        let saturated = possible && self.watch.step(gyro, Some(accel), dt_s);
        self.lost[0] |= saturated;
        let mut readings = [*gyro, *accel];
        for (i, reading) in readings.iter_mut().enumerate() {
            match self.gates[i].step(&reading.clone(), dt_s) {
                Sieved::Good => (),
                Sieved::Late(off, held_s) => *reading += off * (held_s / dt_s),
                Sieved::Refused(reason) => {
                    self.hold(world_from_body, dt_s);
                    return if saturated {
                        self.judge(None)
                    } else {
                        Status::Skipped(reason)
                    };
                }
            }
        }
        self.last = Some([*gyro, *accel]);
        let [turning, force] = readings;
        if dt_s > MAX_GAP_S {
            self.watch.remember(Reason::Gap { seconds: dt_s });
            self.lost = [true; 2];
        } else {
            self.predict(&turning, &force, world_from_body, dt_s);
        }
        let bad = self.correct(world_from_body, velocity, position, dt_s);
        self.judge(bad)
    }

    /// The best guess of unknown readings are the last ones.
    fn hold(&mut self, world_from_body: &UnitQuaternion<f64>, dt_s: f64) {
        if let ([false, false], Some([gyro, accel])) = (self.lost, self.last) {
            self.predict(&gyro, &accel, world_from_body, dt_s.min(MAX_GAP_S));
        }
    }

    /// Inertial readings, velocities and positions refused so far: numbers that nothing measures, and
    /// spikes. Those that disagree with the state are not among them.
    pub fn refused(&self) -> u64 {
        self.refused + self.gates.iter().map(SpikeGate::refused).sum::<u64>()
    }

    /// The readings integrated to their end.
    fn predict(
        &mut self,
        gyro: &Vector3<f64>,
        accel: &Vector3<f64>,
        world_from_body: &UnitQuaternion<f64>,
        dt_s: f64,
    ) {
        let force = accel + world_from_body.inverse() * self.gravity;
        let before = so3::exp(&(gyro * (0.5 * dt_s)));
        let middle = *world_from_body * before.inverse();
        self.position += middle * self.velocity * dt_s;
        self.velocity = so3::exp(&(gyro * -dt_s)) * self.velocity + before.inverse() * force * dt_s;
        self.since_measured_s += dt_s;
    }

    /// What is measured pulls; after a loss it is taken as it is. Returns what is not finite.
    fn correct(
        &mut self,
        world_from_body: &UnitQuaternion<f64>,
        velocity: Option<&Vector3<f64>>,
        position: Option<&Vector3<f64>>,
        dt_s: f64,
    ) -> Option<Reason> {
        let (velocity, bad_velocity) = self.admitted(0, velocity, dt_s);
        let (position, bad_position) = self.admitted(1, position, dt_s);
        let used = [velocity, position];
        let gains = &self.gains;
        let share = |gain: f64| 1.0 - (-gain * dt_s).exp();
        if let Some(measured) = used[1] {
            let error = measured - self.position;
            if std::mem::take(&mut self.lost[1]) {
                self.position = *measured;
            } else {
                let pull = gains.k_vx * dt_s;
                self.velocity += world_from_body.inverse() * error * pull;
                self.position += error * share(gains.k_x);
            }
        }
        if let Some(measured) = used[0] {
            if std::mem::take(&mut self.lost[0]) {
                self.velocity = *measured;
            } else {
                self.velocity += (measured - self.velocity) * share(gains.k_v);
            }
        }
        if used[0].or(used[1]).is_some() {
            self.since_measured_s = 0.0;
        }
        bad_velocity.or(bad_position)
    }

    /// The velocity (0) or position (1) where it may pull, and why it may not. One that disagrees for
    /// longer than the patience takes the state's place.
    fn admitted<'a>(
        &mut self,
        which: usize,
        measured: Option<&'a Vector3<f64>>,
        dt_s: f64,
    ) -> (Option<&'a Vector3<f64>>, Option<Reason>) {
        let Some(value) = measured else {
            return (None, None);
        };
        let (sensor, largest, own) = match which {
            0 => (Sensor::Velocity, limits::SPEED_M_S, self.velocity),
            _ => (Sensor::Pose, limits::POSITION_M, self.position),
        };
        if let Some(reason) = limits::refused(sensor, value, largest) {
            self.refused += 1;
            return (None, Some(reason));
        }
        let off = (value - own).norm() / GATE;
        if self.lost[which] || off <= 1.0 {
            self.disagreed_s[which] = 0.0;
            return (Some(value), None);
        }
        self.disagreed_s[which] += dt_s;
        self.lost[which] |= self.disagreed_s[which] > PATIENCE_S;
        let gated = Reason::Gated {
            sensor,
            distance: off * off,
            limit: 1.0,
        };
        (None, Some(gated))
    }

    fn judge(&self, bad: Option<Reason>) -> Status {
        let coasting = (self.since_measured_s > COASTING_S).then_some(Reason::Coasting {
            seconds: self.since_measured_s,
        });
        match bad.or(self.watch.flaw()).or(coasting) {
            Some(reason) => Status::Weak(reason),
            None => Status::Ok,
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
