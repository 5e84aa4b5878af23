//! Columns of a recording as samples of the estimator.

use crate::arrays::{stamps, vectors3};
use crate::errors::core_error;
use nalgebra::Vector3;
use pyo3::prelude::*;
use sphereflow_observers::imu_bias::{ImuBiasSample, VelocityMeasurement};

/// A velocity with the same standard deviations on all axes.
pub fn measured(
    linear: Vector3<f64>,
    angular: Option<Vector3<f64>>,
    [linear_sigma, angular_sigma]: [f64; 2],
    mean: bool,
) -> VelocityMeasurement {
    VelocityMeasurement {
        is_mean: mean,
        is_mean_angular: mean,
        ..VelocityMeasurement::isotropic(linear, linear_sigma, angular, angular_sigma)
    }
}

/// Rows of [gyro, accelerometer, velocity, angular velocity, field] as samples.
pub fn samples(
    stamp_ns: &Bound<'_, PyAny>,
    columns: [Option<&Bound<'_, PyAny>>; 5],
    sigmas: [f64; 2],
    mean: bool,
) -> PyResult<Vec<ImuBiasSample>> {
    const NAMES: [&str; 5] = [
        "gyro_rad_s",
        "accel_m_s2",
        "velocity_m_s",
        "angular_rad_s",
        "mag_ut",
    ];
    let stamps = stamps(stamp_ns, "stamp_ns")?;
    let count = stamps.len();
    let mut read: [Option<Vec<Vector3<f64>>>; 5] = Default::default();
    for ((column, name), read) in columns.into_iter().zip(NAMES).zip(&mut read) {
        let Some(column) = column else { continue };
        let rows = vectors3(column, name)?;
        if rows.len() != count {
            let (expected, found) = (format!("({count}, 3)"), format!("({}, 3)", rows.len()));
            return Err(core_error(&sphereflow_core::Error::shape(
                name, expected, found,
            )));
        }
        *read = Some(rows);
    }
    let at = |column: usize, i: usize| read[column].as_ref().map(|rows| rows[i]);
    let known = |column: usize, i: usize| at(column, i).filter(|v| !v.iter().all(|x| x.is_nan()));
    // Time goes on from the last stamp that increased; those that do not are skipped samples.
    let mut last = None;
    let mut step = |i: usize| {
        let before = last.unwrap_or(stamps[i]);
        let first = stamps
            .get(1)
            .map_or(0.01, |next| next.seconds_since(stamps[0]));
        let dt_s = last.map_or(first, |last| stamps[i].seconds_since(last));
        last = Some(before.max(stamps[i]));
        dt_s
    };
    Ok((0..count)
        .map(|i| ImuBiasSample {
            dt_s: step(i),
            gyro_rad_s: at(0, i).unwrap_or_default(),
            accel_m_s2: at(1, i).unwrap_or_default(),
            velocity: known(2, i).map(|v| measured(v, known(3, i), sigmas, mean)),
            mag: known(4, i),
        })
        .collect())
}
