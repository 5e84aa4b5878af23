//! `information`: what one range image lets see of the camera's motion.

use crate::camera::PyCamera;
use crate::errors::{IntoPython, Kind, exception};
use crate::motion_arguments::{Image, matrix6};
use crate::plain::Plain;
use crate::reduce::{Reduced, reduced};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use sphereflow_alignment::{Information, direction_name, information};

/// What one range image lets see of the camera's motion (Theorem 3).
#[pyclass(name = "Information", module = "sphereflow.odometry", frozen)]
pub struct PyInformation(pub Information);

#[pymethods]
impl PyInformation {
    /// Mean over the seen solid angle of s s^T, s the derivative of the range's rate by [omega, v],
    /// (6, 6): m^2 for omega, 1 for v.
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix6(py, &self.0.matrix)
    }

    /// Mean range, metres; NaN where nothing was seen.
    #[getter]
    fn mean_range_m(&self) -> f64 {
        self.0.mean_range_m
    }

    /// Eigenvalues of the matrix with omega in units of 1 / mean range, increasing, (6,).
    #[getter]
    fn eigenvalues<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.0.eigenvalues)
    }

    /// Unit vectors [mean_range omega, v] of the eigenvalues, one a row, (6, 6).
    #[getter]
    fn directions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows = self.0.directions.iter().flat_map(|d| d.iter().copied());
        PyArray1::from_iter(py, rows).reshape([6, 6])
    }

    /// 0 (some motion changes nothing) to 1: square root of smallest over largest eigenvalue.
    #[getter]
    fn score(&self) -> f64 {
        self.0.score
    }

    /// Domains that took part.
    #[getter]
    fn domains(&self) -> usize {
        self.0.domains
    }

    /// Motions [omega, v] that change the image less than `limit` times what the best seen one
    /// does, one a row, (k, 6): of unit length once omega is multiplied by the mean range.
    #[pyo3(signature = (limit = 0.01))]
    fn unseen<'py>(&self, py: Python<'py>, limit: f64) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let unseen = self.checked_unseen(limit)?;
        let rows = unseen.iter().flat_map(|d| d.iter().copied());
        PyArray1::from_iter(py, rows).reshape([unseen.len(), 6])
    }

    /// The same in words, in the camera's frame: "translation along (0.00, 0.00, 1.00)".
    #[pyo3(signature = (limit = 0.01))]
    fn unseen_names(&self, limit: f64) -> PyResult<Vec<String>> {
        let unseen = self.checked_unseen(limit)?;
        let names = unseen.iter().filter_map(direction_name);
        Ok(names.map(|name| name.to_string()).collect())
    }

    fn __repr__(&self) -> String {
        format!(
            "Information(score={:.4}, mean_range_m={:.3}, domains={})",
            self.0.score, self.0.mean_range_m, self.0.domains
        )
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        reduced(py, "Information", self.0.to_plain(py)?)
    }
}

impl PyInformation {
    fn checked_unseen(&self, limit: f64) -> PyResult<Vec<nalgebra::Vector6<f64>>> {
        if (0.0..=1.0).contains(&limit) {
            Ok(self.0.unseen(limit))
        } else {
            let text = format!("limit: expected 0 to 1, found {limit}");
            Err(exception(Kind::Value, text))
        }
    }
}

/// What one range image lets see of the camera's motion, before any second image is taken.
///
/// Parameters
/// ----------
/// camera : Camera
///     The depth camera, any model.
/// depth_m : array_like of float, (H, W)
///     Metres; NaN, zero or negative is unknown.
/// along : {'axis', 'ray'}
///     What the image holds: depth along the optical axis, or range along the ray (360 degrees).
///
/// Returns
/// -------
/// Information
///     Matrix, spectrum, score, and the motions that slide the seen surface on itself. An image
///     without known depth has a score of 0 and leaves all six motions unseen.
///
/// Raises
/// ------
/// ShapeError, DtypeError, ValueRangeError
///     Naming the argument.
#[pyfunction]
#[pyo3(name = "information", signature = (camera, depth_m, *, along = "axis"))]
pub fn py_information(
    py: Python<'_>,
    camera: &PyCamera,
    depth_m: &Bound<'_, PyAny>,
    along: &str,
) -> PyResult<PyInformation> {
    let size = (camera.0.width(), camera.0.height());
    let image = Image::new(depth_m, "depth_m", size, along)?;
    py.detach(|| information(&camera.0, image.view()))
        .into_python()
        .map(PyInformation)
}
