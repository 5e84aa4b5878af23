//! What one message of a serial IMU says.

use nalgebra::Vector3;
use sphereflow_core::{ImuSample, MagSample, Stamp};

/// One message. What a message does not hold is `None`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Time of the reading on the device's own clock, nanoseconds, without wraps.
    pub device_ns: Option<i64>,
    /// Angular velocity, rad/s, sensor frame.
    pub gyro_rad_s: Option<Vector3<f64>>,
    /// Specific force, m/s^2, sensor frame.
    pub accel_m_s2: Option<Vector3<f64>>,
    /// Magnetic flux density, microtesla, sensor frame.
    pub mag_ut: Option<Vector3<f64>>,
    /// Temperature of the sensor, degrees Celsius.
    pub temperature_c: Option<f64>,
}

impl Reading {
    /// As an inertial sample at `stamp`; a sensor that the message lacks reads NaN. `None` where it
    /// has neither gyro nor accelerometer.
    pub fn imu(&self, stamp: Stamp) -> Option<ImuSample> {
        let unknown = Vector3::repeat(f64::NAN);
        (self.gyro_rad_s.is_some() || self.accel_m_s2.is_some()).then(|| ImuSample {
            stamp,
            gyro_rad_s: self.gyro_rad_s.unwrap_or(unknown),
            accel_m_s2: self.accel_m_s2.unwrap_or(unknown),
        })
    }

    /// As a magnetic sample at `stamp`.
    pub fn mag(&self, stamp: Stamp) -> Option<MagSample> {
        self.mag_ut.map(|mag_ut| MagSample { stamp, mag_ut })
    }

    /// Whether every number in it is finite.
    pub(crate) fn is_finite(&self) -> bool {
        let vectors = [self.gyro_rad_s, self.accel_m_s2, self.mag_ut];
        let finite = |v: &Vector3<f64>| v.iter().all(|x| x.is_finite());
        vectors.iter().flatten().all(finite) && self.temperature_c.is_none_or(f64::is_finite)
    }
}

/// The count nearest to `last` that a counter of `bits` bits shows as `shown`; `last` is `None` at the
/// first one. Right as long as less than half of the counter's range passes between two messages.
pub fn unwrap_counter(bits: u32, last: Option<i64>, shown: u64) -> i64 {
    let range = 1_i64 << bits.min(62);
    let shown = (shown & (range as u64 - 1)) as i64;
    let Some(last) = last else { return shown };
    let step = shown.wrapping_sub(last).rem_euclid(range);
    last.wrapping_add(if step < range / 2 { step } else { step - range })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counter_that_wraps_goes_on() {
        assert_eq!(unwrap_counter(16, None, 65_535), 65_535);
        assert_eq!(unwrap_counter(16, Some(65_535), 3), 65_539);
        assert_eq!(unwrap_counter(16, Some(65_539), 1), 65_537); // a step back stays one
        assert_eq!(
            unwrap_counter(32, Some(5_000_000_000), 705_032_710),
            5_000_000_006
        );
    }

    #[test]
    fn reading_without_gyro_reads_nan_and_without_both_is_no_sample() {
        let accel = Reading {
            accel_m_s2: Some(Vector3::z()),
            ..Reading::default()
        };
        let sample = accel.imu(Stamp::from_ns(5)).unwrap();
        assert!(sample.gyro_rad_s.x.is_nan() && sample.accel_m_s2.z == 1.0);
        assert!(Reading::default().imu(Stamp::from_ns(5)).is_none());
    }
}
