//! Biases and noise densities of an IMU from a recording at rest.

use crate::Result;
use crate::series::check;
use nalgebra::Vector3;
use sphereflow_core::Stamp;
use sphereflow_observers::{Reason, Status};

/// What a recording at rest tells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuStill {
    /// Mean reading of the gyro: its bias, rad/s.
    pub gyro_bias_rad_s: Vector3<f64>,
    /// Mean reading of the accelerometer, m/s^2: bias and specific force together.
    pub accel_mean_m_s2: Vector3<f64>,
    /// The part of the accelerometer's bias along the specific force, m/s^2. The parts across it
    /// look like a tilt: rest does not show them.
    pub accel_bias_along_up_m_s2: f64,
    /// White noise of each axis, rad/s/sqrt(Hz).
    pub gyro_noise_density: Vector3<f64>,
    /// White noise of each axis, m/s^2/sqrt(Hz).
    pub accel_noise_density: Vector3<f64>,
    /// Readings per second.
    pub rate_hz: f64,
    /// Length, seconds.
    pub duration_s: f64,
    /// Weak where the IMU moved or the recording is short.
    pub status: Status,
}

/// Shorter recordings give biases no better than their noise, seconds.
const LONG_ENOUGH_S: f64 = 10.0;
/// Means of seconds that differ by more than this many of their own standard deviations moved.
const MOVED: f64 = 12.0;

/// From a recording in which nothing moves; `gravity_m_s2` is the local norm of gravity.
///
/// # Errors
/// Shape, order of stamps, numbers that are not finite.
pub fn imu_still(
    gyro: &[Vector3<f64>],
    accel: &[Vector3<f64>],
    stamps: &[Stamp],
    gravity_m_s2: f64,
) -> Result<ImuStill> {
    check("gyro_rad_s", stamps, gyro, 100)?;
    check("accel_m_s2", stamps, accel, 100)?;
    let duration_s = stamps[stamps.len() - 1].seconds_since(stamps[0]);
    let rate_hz = (stamps.len() - 1) as f64 / duration_s;
    let accel_mean = mean(accel);
    let (gyro_sigma, accel_sigma) = (white(gyro), white(accel));
    let moved = moved(gyro, &gyro_sigma, rate_hz) || moved(accel, &accel_sigma, rate_hz);
    let status = if moved {
        Status::Weak(Reason::NotStill)
    } else if duration_s < LONG_ENOUGH_S {
        let seconds = LONG_ENOUGH_S - duration_s;
        Status::Weak(Reason::Settling { seconds })
    } else {
        Status::Ok
    };
    Ok(ImuStill {
        gyro_bias_rad_s: mean(gyro),
        accel_mean_m_s2: accel_mean,
        accel_bias_along_up_m_s2: accel_mean.norm() - gravity_m_s2,
        gyro_noise_density: gyro_sigma / rate_hz.sqrt(),
        accel_noise_density: accel_sigma / rate_hz.sqrt(),
        rate_hz,
        duration_s,
        status,
    })
}

fn mean(values: &[Vector3<f64>]) -> Vector3<f64> {
    values.iter().sum::<Vector3<f64>>() / values.len() as f64
}

/// Standard deviation of one reading from differences of neighbours: drift does not count.
fn white(values: &[Vector3<f64>]) -> Vector3<f64> {
    let sum: Vector3<f64> = values
        .windows(2)
        .map(|w| (w[1] - w[0]).map(|d| d * d))
        .sum();
    (sum / (2.0 * (values.len() - 1) as f64)).map(f64::sqrt)
}

/// True where the means of two seconds differ by more than their noise explains.
fn moved(values: &[Vector3<f64>], sigma: &Vector3<f64>, rate_hz: f64) -> bool {
    let length = (rate_hz.round() as usize).clamp(10, values.len());
    let means: Vec<Vector3<f64>> = values.chunks_exact(length).map(mean).collect();
    let all = mean(values);
    (0..3).any(|axis| {
        let limit = MOVED * sigma[axis] / (length as f64).sqrt() + 1e-9;
        means.iter().any(|m| (m[axis] - all[axis]).abs() > limit)
    })
}
