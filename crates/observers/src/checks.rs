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
