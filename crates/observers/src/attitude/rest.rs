//! Rest: neither gyro nor accelerometer leaves its own low-passed value for a while.

use super::low_pass::{Decay, LowPass};
use nalgebra::Vector3;

/// Time constant of the low-pass, seconds.
pub const REST_TAU_S: f64 = 0.5;
/// So long must it hold, seconds.
const REST_MIN_S: f64 = 1.5;
/// Deviation of the gyro, rad/s.
const REST_GYRO: f64 = 2.0 * std::f64::consts::PI / 180.0;
/// Deviation of the accelerometer, m/s^2.
const REST_ACCEL: f64 = 0.5;

/// Looks for rest.
#[derive(Clone, Copy, Debug)]
pub struct RestDetector {
    low_pass: LowPass<6>,
    held_s: f64,
}

impl RestDetector {
    /// Before the first sample.
    pub fn new() -> Self {
        Self {
            low_pass: LowPass::new(),
            held_s: 0.0,
        }
    }

    /// The next sample. `bias_clip` bounds the low-passed rate: a slow even turn is no rest.
    #[inline]
    pub fn step(
        &mut self,
        gyro: &Vector3<f64>,
        accel: &Vector3<f64>,
        bias_clip: f64,
        dt_s: f64,
        decay: &Decay,
    ) {
        let input = [gyro.x, gyro.y, gyro.z, accel.x, accel.y, accel.z];
        let mean = self.low_pass.step(&input, decay);
        let off = |i: usize| (input[i] - mean[i]) * (input[i] - mean[i]);
        let gyro_off = off(0) + off(1) + off(2);
        let accel_off = off(3) + off(4) + off(5);
        let turning = mean[..3].iter().any(|w| w.abs() > bias_clip);
        if gyro_off >= REST_GYRO * REST_GYRO || accel_off >= REST_ACCEL * REST_ACCEL || turning {
            self.held_s = 0.0;
        } else {
            self.held_s += dt_s;
        }
    }

    /// True after long enough without motion.
    pub fn is_at_rest(&self) -> bool {
        self.held_s >= REST_MIN_S
    }

    /// The low-passed gyro reading, rad/s.
    pub fn mean_gyro(&self) -> Vector3<f64> {
        Vector3::from_column_slice(&self.low_pass.value()[..3])
    }

    /// The low-passed accelerometer reading.
    pub fn mean_accel(&self) -> Vector3<f64> {
        Vector3::from_column_slice(&self.low_pass.value()[3..])
    }

    /// True once the low-passed values mean something.
    pub fn is_settled(&self) -> bool {
        self.low_pass.is_settled(REST_TAU_S)
    }
}
