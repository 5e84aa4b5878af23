//! Single readings that jump away and back: held back for one sample, which tells them from motion.
//!
//! A reading that leaves the one before by more than a body can is not believed until the next one
//! comes. Lies that nearer to it than to the one before, or jumps as well, the jump was real (vibration
//! and knocks jump there and back many times), and what was held back is made up for; else it was a
//! spike, and nothing of it was used. What counts as a jump grows with the usual one.

use crate::limits::refused;
use crate::{Reason, Sensor};
use nalgebra::Vector3;

/// What a sensor's reading may change by without being held back.
#[derive(Clone, Copy, Debug)]
struct Jump {
    /// Between two readings however close, in the sensor's unit.
    at_once: f64,
    /// And so much more each second between them.
    per_s: f64,
}

/// A hand turns a camera with some 100 rad/s^2, a knock with a few times that: one spike of this
/// size, believed, turns the attitude by 2 rad/s * 5 ms = 0.6 degrees. Lower: knocks wait for a
/// sample; higher: larger spikes pass.
const GYRO_JUMP: Jump = Jump {
    at_once: 1.0,
    per_s: 200.0,
};
/// A hand's acceleration changes by some 500 m/s^3: one spike of this size, believed for 5 ms, changes
/// the velocity by 0.08 m/s and tilts no horizon by more than 0.1 degrees. Lower and higher as above.
const ACCEL_JUMP: Jump = Jump {
    at_once: 10.0,
    per_s: 1000.0,
};
/// Velocities from images, of a hand: 3 m/s at once, or 20 m/s^2. They come 30 times a second, each
/// with noise of its own.
const SPEED_JUMP: Jump = Jump {
    at_once: 3.0,
    per_s: 20.0,
};
/// So many times the usual jump is no spike: vibration. Lower: vibration is thinned out before it is
/// known; higher: a spike after a knock passes.
const USUAL: f64 = 4.0;
/// Two jumps in a row are vibration up to this many limits, and all of it is believed. Lower: taps on a
/// sensor lose readings, and its integral drifts; higher: two spikes in a row pass.
const VIBRATION: f64 = 10.0;
/// Time constant of the usual jump, seconds: a single spike hardly counts.
const USUAL_TAU_S: f64 = 0.25;

/// Holds back the spikes of one sensor.
#[derive(Clone, Copy, Debug)]
pub struct SpikeGate {
    sensor: Sensor,
    limit: f64,
    jump: Jump,
    last: Option<Vector3<f64>>,
    /// A reading held back, and the step before it.
    held: Option<(Vector3<f64>, f64)>,
    usual: f64,
    refused: u64,
}

/// What became of a reading.
#[derive(Clone, Copy, Debug)]
pub enum Sieved {
    /// Believed.
    Good,
    /// Believed, and the one before, which was held back, too: it was off the one held in its place
    /// by so much, over so many seconds.
    Late(Vector3<f64>, f64),
    /// Not used: beyond what the sensor reads, not finite, or held back.
    Refused(Reason),
}

impl SpikeGate {
    fn new(sensor: Sensor, limit: f64, jump: Jump) -> Self {
        Self {
            sensor,
            limit,
            jump,
            last: None,
            held: None,
            usual: 0.0,
            refused: 0,
        }
    }

    /// For a gyro, rad/s.
    pub fn gyro() -> Self {
        Self::new(Sensor::Gyro, crate::limits::GYRO_RAD_S, GYRO_JUMP)
    }

    /// For an accelerometer, m/s^2.
    pub fn accel() -> Self {
        Self::new(Sensor::Accel, crate::limits::ACCEL_M_S2, ACCEL_JUMP)
    }

    /// For angular velocities from images, rad/s.
    pub fn turning() -> Self {
        Self::new(Sensor::Velocity, crate::limits::GYRO_RAD_S, GYRO_JUMP)
    }

    /// For linear velocities from images, m/s.
    pub fn speed() -> Self {
        Self::new(Sensor::Velocity, crate::limits::SPEED_M_S, SPEED_JUMP)
    }

    /// Readings refused so far.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// The last reading that was believed.
    #[cfg(test)]
    pub fn last(&self) -> Option<Vector3<f64>> {
        self.last
    }

    /// The next reading, `dt_s` after the one before.
    pub fn step(&mut self, reading: &Vector3<f64>, dt_s: f64) -> Sieved {
        if let Some(reason) = refused(self.sensor, reading, self.limit) {
            self.refused += 1;
            self.held = None;
            return Sieved::Refused(reason);
        }
        let Some(last) = self.last else {
            self.last = Some(*reading);
            return Sieved::Good;
        };
        let found = (reading - last).norm();
        let limit = self.jump.at_once + self.jump.per_s * dt_s + USUAL * self.usual;
        let share = dt_s / (dt_s + USUAL_TAU_S);
        self.usual += share * (found.min(limit) - self.usual);
        match self.held.take() {
            Some((held, held_s)) if (reading - held).norm() < found => {
                self.refused -= 1;
                self.last = Some(*reading);
                Sieved::Late(held - last, held_s)
            }
            Some((held, held_s)) if found > limit && found < VIBRATION * limit => {
                self.refused -= 1;
                self.last = Some(*reading);
                Sieved::Late(held - last, held_s)
            }
            before if found > limit && (before.is_none() || found > 2.0 * limit) => {
                self.held = Some((*reading, dt_s));
                self.refused += 1;
                let sensor = self.sensor;
                Sieved::Refused(Reason::Spike {
                    sensor,
                    found,
                    limit,
                })
            }
            _ => {
                self.last = Some(*reading);
                Sieved::Good
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT_S: f64 = 0.005;

    fn x(value: f64) -> Vector3<f64> {
        Vector3::new(value, 0.0, 0.0)
    }

    /// The integral of what is believed, refused readings replaced by the last one.
    fn integral(readings: &[f64]) -> (f64, u64) {
        let mut gate = SpikeGate::gyro();
        let mut sum = 0.0;
        for reading in readings {
            match gate.step(&x(*reading), DT_S) {
                Sieved::Good => sum += reading * DT_S,
                Sieved::Late(off, held_s) => sum += reading * DT_S + off.x * held_s,
                Sieved::Refused(_) => sum += gate.last().map_or(0.0, |v| v.x) * DT_S,
            }
        }
        (sum, gate.refused())
    }

    #[test]
    fn spike_of_any_size_adds_nothing() {
        for size in [10.0, -30.0, 99.0, 200.0, 1e160, f64::NAN] {
            let mut readings = [0.5; 40];
            readings[20] = size;
            let (sum, refused) = integral(&readings);
            assert!((sum - 0.1).abs() < 1e-12, "{size}: {sum}");
            assert_eq!(refused, 1, "{size}");
        }
    }

    #[test]
    fn jump_that_stays_is_believed_whole() {
        let readings: Vec<f64> = (0..40).map(|i| if i < 20 { 0.0 } else { 8.0 }).collect();
        let (sum, refused) = integral(&readings);
        assert!((sum - 20.0 * 8.0 * DT_S).abs() < 1e-12, "{sum}");
        assert_eq!(refused, 0);
    }

    #[test]
    fn vibration_is_believed_after_a_moment() {
        let readings: Vec<f64> = (0..2000)
            .map(|i| if i % 2 == 0 { 5.0 } else { -5.0 })
            .collect();
        let (_, refused) = integral(&readings);
        assert!(refused < 60, "{refused}");
        let quiet = readings.iter().map(|r| r * 0.15).collect::<Vec<_>>();
        assert_eq!(integral(&quiet).1, 0);
    }
}
