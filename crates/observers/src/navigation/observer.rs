//! The thesis's observer of velocity and position.
//!
//! Thesis: eq. (9.5), with gravity added: `v' = v x omega_m + a_m + q* G q + ...`, G = (0, +9.81, 0)
//! with y down. As printed (`- q* A q`) it stands 1 m and 4 m/s off.

use super::config::NavigationConfig;
use crate::checks::{Watch, is_finite};
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
    since_measured_s: f64,
    /// The motion since the last sample is unknown: velocity, position.
    lost: [bool; 2],
}

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
        if !(dt_s > 0.0 && dt_s.is_finite()) {
            return Status::Skipped(Reason::StampNotIncreasing);
        }
        let attitude = Vector3::from_column_slice(&world_from_body.coords.as_slice()[..3]);
        for (sensor, value) in [
            (Sensor::Gyro, gyro),
            (Sensor::Accel, accel),
            (Sensor::Pose, &(attitude * world_from_body.w)),
        ] {
            if !is_finite(value) {
                // The best guess of unknown readings are the last ones.
                if let ([false, false], Some([gyro, accel])) = (self.lost, self.last) {
                    self.predict(&gyro, &accel, world_from_body, dt_s.min(MAX_GAP_S));
                }
                return Status::Skipped(Reason::NotFinite { sensor });
            }
        }
        self.last = Some([*gyro, *accel]);
        let saturated = self.watch.step(gyro, Some(accel), dt_s);
        if dt_s > MAX_GAP_S {
            self.watch.remember(Reason::Gap { seconds: dt_s });
            self.lost = [true; 2];
        } else {
            if saturated {
                self.lost[0] = true;
            }
            self.predict(gyro, accel, world_from_body, dt_s);
        }
        let bad = self.correct(world_from_body, velocity, position, dt_s);
        self.judge(bad)
    }

    /// The readings integrated to their end.
    fn predict(
        &mut self,
        gyro: &Vector3<f64>,
        accel: &Vector3<f64>,
        world_from_body: &UnitQuaternion<f64>,
        dt_s: f64,
    ) {
        if !world_from_body.coords.iter().all(|c| c.is_finite()) {
            return;
        }
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
        let gains = &self.gains;
        let share = |gain: f64| 1.0 - (-gain * dt_s).exp();
        let used = [velocity, position].map(|v| v.filter(|v| is_finite(v)));
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
        let sensor = match (velocity, position, used) {
            (Some(_), _, [None, _]) => Sensor::Velocity,
            (_, Some(_), [_, None]) => Sensor::Pose,
            _ => return None,
        };
        Some(Reason::NotFinite { sensor })
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
