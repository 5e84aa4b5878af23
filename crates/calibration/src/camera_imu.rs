//! Rotation and time offset between camera and IMU, from the gyro against angular velocities that
//! were measured in images.

use crate::Result;
use crate::series::check;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use sphereflow_core::Stamp;
use sphereflow_core::checks::positive;
use sphereflow_observers::{Reason, Status};

/// The calibration: `omega_camera(t) = camera_from_imu (omega_imu(t + offset) - bias)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraImu {
    /// Rotation.
    pub camera_from_imu: UnitQuaternion<f64>,
    /// `imu_time = camera_time + time_offset_s`.
    pub time_offset_s: f64,
    /// To be subtracted from the gyro, rad/s.
    pub gyro_bias_rad_s: Vector3<f64>,
    /// Root mean square of what is left, rad/s.
    pub residual_rad_s: f64,
    /// Weak where the camera turned about one axis only, or too evenly to tell the offset.
    pub status: Status,
}

/// Steps of the search over offsets.
const STEPS: usize = 81;
/// Second singular value of the rates, rad/s: a second axis must turn at least so much, rms.
const SECOND_AXIS: f64 = 0.05;
/// The residual at the ends of the search must exceed the least by this factor.
const SHARP: f64 = 1.05;

/// One offset's best rotation and bias.
struct Fit {
    rotation: Matrix3<f64>,
    gyro_mean: Vector3<f64>,
    camera_mean: Vector3<f64>,
    residual: f64,
    second: f64,
}

/// `camera` are angular velocities in the camera's frame at `camera_stamps` (the middle of the
/// frames that they were measured between), `gyro` readings at `gyro_stamps`; offsets up to
/// `largest_offset_s` are tried.
///
/// # Errors
/// Shapes, order of stamps, numbers that are not finite, recordings that do not overlap.
pub fn camera_imu(
    camera: &[Vector3<f64>],
    camera_stamps: &[Stamp],
    gyro: &[Vector3<f64>],
    gyro_stamps: &[Stamp],
    largest_offset_s: f64,
) -> Result<CameraImu> {
    check("camera_rad_s", camera_stamps, camera, 20)?;
    check("gyro_rad_s", gyro_stamps, gyro, 20)?;
    positive("largest_offset_s", largest_offset_s)?;
    let fits_at = |offset_s: f64| fit(camera, camera_stamps, gyro, gyro_stamps, offset_s);
    let step_s = 2.0 * largest_offset_s / (STEPS - 1) as f64;
    let offset = |i: usize| -largest_offset_s + i as f64 * step_s;
    let residuals: Vec<f64> = (0..STEPS)
        .map(|i| fits_at(offset(i)).map_or(f64::INFINITY, |f| f.residual))
        .collect();
    let best = (0..STEPS)
        .min_by(|a, b| residuals[*a].total_cmp(&residuals[*b]))
        .unwrap_or(0);
    let time_offset_s = refined(fits_at, offset(best), step_s);
    let Some(found) = fits_at(time_offset_s) else {
        let error = sphereflow_core::Error::value(
            "gyro_stamp_ns",
            "readings during at least 20 of the camera's",
            "none",
        );
        return Err(error);
    };
    let rotation =
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(found.rotation));
    let ends = residuals[0].max(residuals[STEPS - 1]);
    let inside = best > 0 && best + 1 < STEPS;
    let status = if found.second < SECOND_AXIS {
        Status::Weak(Reason::Unobservable { directions: 1 })
    } else if !inside || ends < SHARP * found.residual {
        Status::Weak(Reason::OffsetUnclear)
    } else {
        Status::Ok
    };
    Ok(CameraImu {
        camera_from_imu: rotation,
        time_offset_s,
        gyro_bias_rad_s: found.gyro_mean - found.rotation.transpose() * found.camera_mean,
        residual_rad_s: found.residual,
        status,
    })
}

/// Golden sections around the best step.
fn refined(fits_at: impl Fn(f64) -> Option<Fit>, centre: f64, step_s: f64) -> f64 {
    let cost = |offset: f64| fits_at(offset).map_or(f64::INFINITY, |f| f.residual);
    let ratio = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (centre - step_s, centre + step_s);
    for _ in 0..30 {
        let (a, b) = (high - ratio * (high - low), low + ratio * (high - low));
        if cost(a) < cost(b) { high = b } else { low = a }
    }
    0.5 * (low + high)
}

/// Rotation (Kabsch) and means for one offset.
fn fit(
    camera: &[Vector3<f64>],
    camera_stamps: &[Stamp],
    gyro: &[Vector3<f64>],
    gyro_stamps: &[Stamp],
    offset_s: f64,
) -> Option<Fit> {
    let mut next = 0;
    let mut pairs: Vec<(Vector3<f64>, Vector3<f64>)> = Vec::with_capacity(camera.len());
    for (omega, stamp) in camera.iter().zip(camera_stamps) {
        let at = stamp.plus_seconds(offset_s);
        while next + 1 < gyro_stamps.len() && gyro_stamps[next + 1] <= at {
            next += 1;
        }
        if next + 1 >= gyro_stamps.len() || at < gyro_stamps[0] {
            continue;
        }
        let whole = gyro_stamps[next + 1].seconds_since(gyro_stamps[next]);
        let share = at.seconds_since(gyro_stamps[next]) / whole;
        pairs.push((*omega, gyro[next] * (1.0 - share) + gyro[next + 1] * share));
    }
    if pairs.len() < 20 {
        return None;
    }
    let count = pairs.len() as f64;
    let camera_mean = pairs.iter().map(|p| p.0).sum::<Vector3<f64>>() / count;
    let gyro_mean = pairs.iter().map(|p| p.1).sum::<Vector3<f64>>() / count;
    let cross: Matrix3<f64> = pairs
        .iter()
        .map(|(c, g)| (c - camera_mean) * (g - gyro_mean).transpose())
        .sum();
    let svd = (cross / count).svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let sign = (u * v_t).determinant().signum();
    let rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t;
    let off = |(c, g): &(Vector3<f64>, Vector3<f64>)| {
        (c - camera_mean - rotation * (g - gyro_mean)).norm_squared()
    };
    Some(Fit {
        rotation,
        gyro_mean,
        camera_mean,
        residual: (pairs.iter().map(off).sum::<f64>() / count).sqrt(),
        second: svd.singular_values[1].max(0.0).sqrt(),
    })
}
