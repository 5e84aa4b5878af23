//! Arrays of measurements into a bundle adjustment problem, and its pixels out of it.

use crate::arrays::{floats, indices, vectors3};
use crate::errors::{IntoPython, Kind, exception};
use nalgebra::{Matrix2, Matrix3, Vector2};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use sphereflow_solver::bundle::BundleProblem;

/// Poses (N,), points (N,), pixels (N, 2).
pub type Pixels<'py> = (
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray2<f64>>,
);

type Arrays<'a, 'py> = (&'a Bound<'py, PyAny>, &'a Bound<'py, PyAny>);

/// Indices of poses and points, as many of each as there are measurements.
fn pairs((pose, point): Arrays, measurements: usize) -> PyResult<Vec<(usize, usize)>> {
    let (pose, point) = (indices(pose, "pose")?, indices(point, "point")?);
    for found in [point.len(), measurements] {
        if found != pose.len() {
            let expected = pose.len();
            let text = format!(
                "pose, point, measurement: expected one length, found {expected} and {found}"
            );
            return Err(exception(Kind::Shape, text));
        }
    }
    Ok(pose.into_iter().zip(point).collect())
}

pub fn add_pixels(
    problem: &mut BundleProblem,
    seen: Arrays,
    pixel: &Bound<'_, PyAny>,
    sigma_px: f64,
) -> PyResult<()> {
    let pixel = floats(pixel, "pixel", &[None, Some(2)])?;
    let pixel = pixel.as_slice()?.chunks_exact(2);
    let covariance = Matrix2::identity() * sigma_px * sigma_px;
    for ((pose, point), uv) in pairs(seen, pixel.len())?.into_iter().zip(pixel) {
        let uv = Vector2::new(uv[0], uv[1]);
        let added = problem.add_pixel(pose, point, uv, &covariance);
        added.into_python()?;
    }
    Ok(())
}

pub fn add_points(
    problem: &mut BundleProblem,
    seen: Arrays,
    point_in_camera_m: &Bound<'_, PyAny>,
    sigma_m: f64,
) -> PyResult<()> {
    let measured = vectors3(point_in_camera_m, "point_in_camera_m")?;
    let covariance = Matrix3::identity() * sigma_m * sigma_m;
    for ((pose, point), x) in pairs(seen, measured.len())?.into_iter().zip(measured) {
        let added = problem.add_point_measurement(pose, point, x, &covariance);
        added.into_python()?;
    }
    Ok(())
}

pub fn add_inverse_ranges(
    problem: &mut BundleProblem,
    seen: Arrays,
    inv_range: &Bound<'_, PyAny>,
    sigma: f64,
) -> PyResult<()> {
    let measured = floats(inv_range, "inv_range", &[None])?;
    let measured = measured.as_slice()?;
    for ((pose, point), value) in pairs(seen, measured.len())?.into_iter().zip(measured) {
        let added = problem.add_inverse_range(pose, point, *value, sigma);
        added.into_python()?;
    }
    Ok(())
}

/// The measured pixels of a problem.
pub fn pixels<'py>(py: Python<'py>, problem: &BundleProblem) -> PyResult<Pixels<'py>> {
    let (mut poses, mut points, mut values) = (Vec::new(), Vec::new(), Vec::new());
    for (pose, point, pixel) in problem.pixels() {
        poses.push(pose as i64);
        points.push(point as i64);
        values.extend(pixel.iter());
    }
    let count = poses.len();
    Ok((
        PyArray1::from_vec(py, poses),
        PyArray1::from_vec(py, points),
        PyArray1::from_vec(py, values).reshape([count, 2])?,
    ))
}
