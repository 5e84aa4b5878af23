//! What can be wrong with a sample of gyro, accelerometer and magnetometer.

use crate::status::{Reason, Sensor};
use nalgebra::Vector3;

/// So long must an axis read the same number to be called dead, seconds.
const DEAD_S: f64 = 2.0;
/// Mean norms of an accelerometer that reads g, and of one that reads m/s^2.
const IN_G: std::ops::Range<f64> = 0.7..1.3;
const IN_SI: std::ops::Range<f64> = 7.0..13.0;

/// True where all components are finite.
pub fn is_finite(v: &Vector3<f64>) -> bool {
    v.iter().all(|x| x.is_finite())
}

/// Looks for axes that never change while the others do.
#[derive(Clone, Copy, Debug)]
pub struct DeadAxis {
    last: Vector3<f64>,
    same_s: [f64; 3],
}

impl DeadAxis {
    /// Before the first sample.
    pub fn new() -> Self {
        Self {
            last: Vector3::repeat(f64::NAN),
            same_s: [0.0; 3],
        }
    }

    /// The next sample; the dead axis, if there is one.
    #[inline]
    pub fn step(&mut self, sample: &Vector3<f64>, dt_s: f64) -> Option<usize> {
        let mut alive = false;
        for axis in 0..3 {
            if sample[axis] == self.last[axis] {
                self.same_s[axis] += dt_s;
            } else {
                self.same_s[axis] = 0.0;
                alive = true;
            }
        }
        self.last = *sample;
        if !alive {
            return None;
        }
        (0..3).find(|axis| self.same_s[*axis] > DEAD_S)
    }
}

/// What the mean norm of the accelerometer says of its unit.
pub fn unit_of_norm(mean_norm: f64) -> Option<Reason> {
    if IN_SI.contains(&mean_norm) {
        None
    } else if IN_G.contains(&mean_norm) {
        Some(Reason::AccelInG { norm: mean_norm })
    } else {
        Some(Reason::AccelNorm { norm: mean_norm })
    }
}

/// The same of a mean reading; quick where all is well.
#[inline]
pub fn accel_unit(mean: &Vector3<f64>) -> Option<Reason> {
    let square = mean.norm_squared();
    let fine = square > IN_SI.start * IN_SI.start && square < IN_SI.end * IN_SI.end;
    if fine {
        None
    } else {
        unit_of_norm(square.sqrt())
    }
}

/// A gyro at the end of its range.
pub fn saturated(gyro: &Vector3<f64>, limit: f64) -> Option<Reason> {
    let found = gyro.amax();
    (found >= 0.999 * limit).then_some(Reason::Saturated {
        sensor: Sensor::Gyro,
        found,
    })
}

/// Time constant of the accelerometer's mean norm, and the time before it says anything, seconds.
const NORM_TAU_S: f64 = 2.0;
const NORM_KNOWN_S: f64 = 0.5;
/// So long a status goes on speaking of a flaw that is over, seconds.
const LASTING_S: f64 = 1.0;

/// What the samples of gyro and accelerometer say of their sensors, beyond their own instant.
#[derive(Clone, Copy, Debug)]
pub struct Watch {
    gyro_limit: f64,
    gyro_axes: DeadAxis,
    accel_axes: DeadAxis,
    dead: Option<Reason>,
    mean_norm: f64,
    known_s: f64,
    /// What was wrong, and for how long it is still told, seconds.
    lasting: Option<(Reason, f64)>,
}

impl Watch {
    /// Before the first sample; `gyro_limit` is the largest rate that the gyro reads, rad/s.
    pub fn new(gyro_limit: f64) -> Self {
        Self {
            gyro_limit,
            gyro_axes: DeadAxis::new(),
            accel_axes: DeadAxis::new(),
            dead: None,
            mean_norm: 0.0,
            known_s: 0.0,
            lasting: None,
        }
    }

    /// The next finite sample, `dt_s` after the one before. True where the gyro is at its limit.
    pub fn step(&mut self, gyro: &Vector3<f64>, accel: Option<&Vector3<f64>>, dt_s: f64) -> bool {
        self.lasting = self
            .lasting
            .map(|(reason, left_s)| (reason, left_s - dt_s))
            .filter(|(_, left_s)| *left_s > 0.0);
        let found = saturated(gyro, self.gyro_limit);
        if let Some(reason) = found {
            self.remember(reason);
        }
        let dead = |sensor: Sensor| move |axis: usize| Reason::DeadAxis { sensor, axis };
        self.dead = self.gyro_axes.step(gyro, dt_s).map(dead(Sensor::Gyro));
        if let Some(accel) = accel {
            let axis = self.accel_axes.step(accel, dt_s);
            self.dead = self.dead.or(axis.map(dead(Sensor::Accel)));
            self.known_s += dt_s;
            let share = (dt_s / self.known_s).max(1.0 - (-dt_s / NORM_TAU_S).exp());
            self.mean_norm += share * (accel.norm() - self.mean_norm);
        }
        found.is_some()
    }

    /// Speak of a flaw for a while.
    pub fn remember(&mut self, reason: Reason) {
        self.lasting = Some((reason, LASTING_S));
    }

    /// The worst that is to be said of the sensors.
    pub fn flaw(&self) -> Option<Reason> {
        let unit = || {
            let known = self.known_s > NORM_KNOWN_S;
            known.then(|| unit_of_norm(self.mean_norm)).flatten()
        };
        self.dead
            .or_else(unit)
            .or(self.lasting.map(|(reason, _)| reason))
    }
}
