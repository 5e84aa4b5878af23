//! Noise of a consumer-grade inertial sensor, as data sheets give it: what all settings start from.
//!
//! One set for every recording. A sensor that is better, or worse, gets its own numbers from its data
//! sheet, or from a recording at rest (`sphereflow_calibration::imu_still`).

/// Gyro, rad/s/sqrt(Hz): 0.01 deg/s/sqrt(Hz).
const GYRO_DENSITY: f64 = 1.75e-4;
/// Accelerometer, m/s^2/sqrt(Hz): 0.2 mg/sqrt(Hz).
const ACCEL_DENSITY: f64 = 2e-3;
/// How the gyro's bias wanders, rad/s/sqrt(s): 10 deg/h in a few seconds.
pub const GYRO_WALK: f64 = 2e-5;
/// How the accelerometer's bias wanders, m/s^2/sqrt(s): 0.5 mg in a minute and a half.
pub const ACCEL_WALK: f64 = 5e-4;
/// The common rate of inertial readings, Hz.
const RATE_HZ: f64 = 200.0;

/// Standard deviation of one reading from the density of its white noise, at a rate.
pub fn reading_sigma(density: f64, rate_hz: f64) -> f64 {
    density * rate_hz.sqrt()
}

/// Of one gyro reading, rad/s.
pub fn gyro_sigma() -> f64 {
    reading_sigma(GYRO_DENSITY, RATE_HZ)
}

/// Of one accelerometer reading, m/s^2.
pub fn accel_sigma() -> f64 {
    reading_sigma(ACCEL_DENSITY, RATE_HZ)
}
