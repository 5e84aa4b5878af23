//! What no sensor reads: numbers beyond these are faults of the line or the driver, not measurements.
//!
//! They bound what a filter ever has to compute with, so that no sum or square of accepted numbers
//! leaves the range in which double precision means something.

use crate::{Reason, Sensor};
use nalgebra::{SMatrix, Vector3};
use std::ops::RangeInclusive;

/// Largest rate about an axis, rad/s (5730 deg/s). Gyroscopes of cameras, phones and drones end at
/// 2000 deg/s, the widest of them at 4000 deg/s (69.8 rad/s), data sheets say. Lower: a fast
/// sensor is cut; higher: wilder numbers are believed until the gate for spikes sees them.
pub const GYRO_RAD_S: f64 = 100.0;
/// Largest specific force along an axis, m/s^2 (41 g). Inertial units end at 16 g, the widest of
/// them at 32 g (314 m/s^2), data sheets say. Lower: hard shocks are cut; higher: as above.
pub const ACCEL_M_S2: f64 = 400.0;
/// Largest component of a magnetic field in any unit: 0.1 T in nT. The Earth's field is 65 000 nT.
pub const MAG: f64 = 1e8;
/// Least norm of a magnetic field in any unit: what is smaller is no reading.
pub const MAG_LEAST: f64 = 1e-9;
/// Largest speed that images measure, m/s: that of a bullet.
pub const SPEED_M_S: f64 = 1e3;
/// Largest coordinate of a position, m: a hundred times around the Earth.
pub const POSITION_M: f64 = 4e9;
/// Standard deviations of measurements: below, they are exact, above, they say nothing.
pub const SIGMA: RangeInclusive<f64> = 1e-9..=1e9;
/// Shortest time step, seconds: no sensor comes at a megahertz, and two stamps closer than this are
/// of one sample.
pub const SHORTEST_STEP_S: f64 = 1e-6;
/// Gains, noises and times among the settings, SI units.
pub const SETTING: RangeInclusive<f64> = 1e-12..=1e12;

/// Why a vector of a sensor cannot be a reading: not finite, or a component beyond `limit`.
pub fn refused(sensor: Sensor, value: &Vector3<f64>, limit: f64) -> Option<Reason> {
    if value.iter().all(|v| v.abs() <= limit) {
        return None;
    }
    if value.iter().any(|v| !v.is_finite()) {
        return Some(Reason::NotFinite { sensor });
    }
    let found = value.amax();
    Some(Reason::OutOfRange {
        sensor,
        found,
        limit,
    })
}

/// Why a magnetic field cannot be a reading.
pub fn refused_field(mag: &Vector3<f64>) -> Option<Reason> {
    let sensor = Sensor::Mag;
    let too_small = mag.norm() < MAG_LEAST;
    refused(sensor, mag, MAG).or(too_small.then_some(Reason::NotFinite { sensor }))
}

/// True for a time step that can be computed with.
pub fn is_step(dt_s: f64) -> bool {
    dt_s >= SHORTEST_STEP_S && dt_s.is_finite()
}

/// Why a covariance cannot be one: not finite, not symmetric positive definite, or its standard
/// deviations beyond [`SIGMA`].
pub fn refused_covariance<const N: usize>(
    sensor: Sensor,
    covariance: &SMatrix<f64, N, N>,
) -> Option<Reason> {
    if covariance.iter().any(|v| !v.is_finite()) {
        return Some(Reason::NotFinite { sensor });
    }
    let spread = |i: usize| covariance[(i, i)].max(0.0).sqrt();
    let in_range = (0..N).all(|i| SIGMA.contains(&spread(i)));
    // As correlations: the units of rows do not matter.
    let correlation = SMatrix::<f64, N, N>::from_fn(|i, j| {
        let both = spread(i) * spread(j);
        0.5 * (covariance[(i, j)] + covariance[(j, i)]) / both
    });
    let definite = in_range && is_definite(&correlation);
    (!definite).then_some(Reason::BadCovariance { sensor })
}

/// Cholesky's factorisation without its factor: true where all pivots are above zero.
fn is_definite<const N: usize>(matrix: &SMatrix<f64, N, N>) -> bool {
    let mut left = *matrix;
    for k in 0..N {
        let pivot = left[(k, k)];
        if pivot.is_nan() || pivot <= f64::EPSILON {
            return false;
        }
        for i in k + 1..N {
            let share = left[(i, k)] / pivot;
            for j in k + 1..N {
                left[(i, j)] -= share * left[(k, j)];
            }
        }
    }
    true
}
