//! Calibration of inertial and magnetic sensors from recordings.

use crate::arguments::reason_text;
use crate::arrays::{array1, square, stamps, vectors3, xyzw};
use crate::errors::IntoPython;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sphereflow_calibration::{camera_imu, imu_still, mag_ellipsoid};
use sphereflow_observers::Status;

fn status_items(dict: &Bound<'_, PyDict>, status: Status) -> PyResult<()> {
    dict.set_item("status", status.name())?;
    dict.set_item("reason", reason_text(status.reason()))
}

/// Biases and noise densities of an IMU at rest.
///
/// Parameters
/// ----------
/// gyro_rad_s, accel_m_s2 : array_like, (N, 3)
///     Readings.
/// stamp_ns : array_like of int, (N,)
///     Their stamps.
/// gravity_m_s2 : float
///     Local norm of gravity.
///
/// Returns
/// -------
/// dict
///     `gyro_bias_rad_s`, `accel_mean_m_s2`, `accel_bias_along_up_m_s2`, `gyro_noise_density`,
///     `accel_noise_density`, `rate_hz`, `duration_s`, `status`, `reason`.
#[pyfunction]
#[pyo3(name = "calibrate_imu_still", signature = (gyro_rad_s, accel_m_s2, stamp_ns, *, gravity_m_s2 = 9.81))]
pub fn calibrate_imu_still<'py>(
    py: Python<'py>,
    gyro_rad_s: &Bound<'py, PyAny>,
    accel_m_s2: &Bound<'py, PyAny>,
    stamp_ns: &Bound<'py, PyAny>,
    gravity_m_s2: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let gyro = vectors3(gyro_rad_s, "gyro_rad_s")?;
    let accel = vectors3(accel_m_s2, "accel_m_s2")?;
    let stamps = stamps(stamp_ns, "stamp_ns")?;
    let found = imu_still(&gyro, &accel, &stamps, gravity_m_s2).into_python()?;
    let dict = PyDict::new(py);
    dict.set_item("gyro_bias_rad_s", array1(py, &found.gyro_bias_rad_s))?;
    dict.set_item("accel_mean_m_s2", array1(py, &found.accel_mean_m_s2))?;
    dict.set_item("accel_bias_along_up_m_s2", found.accel_bias_along_up_m_s2)?;
    dict.set_item("gyro_noise_density", array1(py, &found.gyro_noise_density))?;
    dict.set_item(
        "accel_noise_density",
        array1(py, &found.accel_noise_density),
    )?;
    dict.set_item("rate_hz", found.rate_hz)?;
    dict.set_item("duration_s", found.duration_s)?;
    status_items(&dict, found.status)?;
    Ok(dict)
}

/// Hard and soft iron of a magnetometer that was turned all ways.
///
/// Parameters
/// ----------
/// mag_ut : array_like, (N, 3)
///     Readings.
///
/// Returns
/// -------
/// dict
///     `hard_iron_ut` (3,), `correction` (3, 3) with `calibrated = correction (reading - hard_iron)`,
///     `field_ut`, `residual_ut`, `status`, `reason`.
#[pyfunction]
#[pyo3(name = "calibrate_mag_ellipsoid")]
pub fn calibrate_mag_ellipsoid<'py>(
    py: Python<'py>,
    mag_ut: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyDict>> {
    let found = mag_ellipsoid(&vectors3(mag_ut, "mag_ut")?).into_python()?;
    let dict = PyDict::new(py);
    dict.set_item("hard_iron_ut", array1(py, &found.hard_iron_ut))?;
    dict.set_item("correction", square(py, found.correction.as_slice(), 3)?)?;
    dict.set_item("field_ut", found.field_ut)?;
    dict.set_item("residual_ut", found.residual_ut)?;
    status_items(&dict, found.status)?;
    Ok(dict)
}

/// Rotation and time offset between camera and IMU from angular velocities of both.
///
/// Parameters
/// ----------
/// camera_rad_s : array_like, (N, 3)
///     Angular velocities from images, camera frame.
/// camera_stamp_ns : array_like of int, (N,)
///     The middle of the frames that each was measured between.
/// gyro_rad_s : array_like, (M, 3)
///     Gyro readings.
/// gyro_stamp_ns : array_like of int, (M,)
///     Their stamps.
/// largest_offset_s : float
///     Offsets up to this size are tried.
///
/// Returns
/// -------
/// dict
///     `quat_xyzw` (camera from IMU), `time_offset_s` (IMU time = camera time + offset),
///     `gyro_bias_rad_s`, `residual_rad_s`, `status`, `reason`.
#[pyfunction]
#[pyo3(name = "calibrate_camera_imu", signature = (camera_rad_s, camera_stamp_ns, gyro_rad_s,
    gyro_stamp_ns, *, largest_offset_s = 0.1))]
pub fn calibrate_camera_imu<'py>(
    py: Python<'py>,
    camera_rad_s: &Bound<'py, PyAny>,
    camera_stamp_ns: &Bound<'py, PyAny>,
    gyro_rad_s: &Bound<'py, PyAny>,
    gyro_stamp_ns: &Bound<'py, PyAny>,
    largest_offset_s: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let camera = vectors3(camera_rad_s, "camera_rad_s")?;
    let camera_stamps = stamps(camera_stamp_ns, "camera_stamp_ns")?;
    let gyro = vectors3(gyro_rad_s, "gyro_rad_s")?;
    let gyro_stamps = stamps(gyro_stamp_ns, "gyro_stamp_ns")?;
    let found = py
        .detach(|| {
            camera_imu(
                &camera,
                &camera_stamps,
                &gyro,
                &gyro_stamps,
                largest_offset_s,
            )
        })
        .into_python()?;
    let dict = PyDict::new(py);
    dict.set_item(
        "quat_xyzw",
        PyArray1::from_slice(py, &xyzw(&found.camera_from_imu)),
    )?;
    dict.set_item("time_offset_s", found.time_offset_s)?;
    dict.set_item("gyro_bias_rad_s", array1(py, &found.gyro_bias_rad_s))?;
    dict.set_item("residual_rad_s", found.residual_rad_s)?;
    status_items(&dict, found.status)?;
    Ok(dict)
}
