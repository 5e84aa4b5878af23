//! `Camera`: every model behind one class.

use crate::arrays::{floats, vectors3};
use crate::errors::IntoPython;
use crate::plain::Plain;
use crate::reduce::{Reduced, reduced};
use nalgebra::Vector2;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};
use sphereflow_sphere::Camera;
use std::collections::BTreeMap;

/// A central camera: a model and the size of its image.
///
/// Made by one constructor a model (`pinhole`, `opencv`, `inverse_polynomial`, `fov`,
/// `kannala_brandt`, `unified`, `double_sphere`, `equirectangular`) or by `from_parameters`. Focal
/// lengths and principal point are in pixels, distortion is without unit. The camera frame is x right,
/// y down, z forward; pixel centres lie at integers, so the image spans [-0.5, W-0.5] x [-0.5, H-0.5].
///
/// Every constructor raises `ValueRangeError` naming the parameter that is NaN or out of its domain.
#[pyclass(name = "Camera", module = "sphereflow", frozen, eq)]
#[derive(Clone, PartialEq)]
pub struct PyCamera(pub Camera);

#[pymethods]
impl PyCamera {
    /// Perspective camera with optional skew (thesis 1.4).
    #[staticmethod]
    #[pyo3(signature = (fx, fy, cx, cy, width, height, *, skew = 0.0))]
    #[allow(clippy::too_many_arguments)]
    fn pinhole(
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        width: usize,
        height: usize,
        skew: f64,
    ) -> PyResult<Self> {
        Camera::pinhole_with_skew(fx, fy, cx, cy, skew, width, height)
            .into_python()
            .map(Self)
    }

    /// OpenCV's lens model: radial k1..k6 (rational) and tangential p1, p2.
    #[staticmethod]
    #[pyo3(signature = (fx, fy, cx, cy, width, height, *, k1 = 0.0, k2 = 0.0, p1 = 0.0, p2 = 0.0,
        k3 = 0.0, k4 = 0.0, k5 = 0.0, k6 = 0.0))]
    #[allow(clippy::too_many_arguments)]
    fn opencv(
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        width: usize,
        height: usize,
        k1: f64,
        k2: f64,
        p1: f64,
        p2: f64,
        k3: f64,
        k4: f64,
        k5: f64,
        k6: f64,
    ) -> PyResult<Self> {
        let distortion = [k1, k2, p1, p2, k3, k4, k5, k6];
        Camera::opencv(fx, fy, cx, cy, distortion, width, height)
            .into_python()
            .map(Self)
    }

    /// The thesis's inverse polynomial r_u = r_d (1 + k1 r_d^2 + ...) (1.5).
    #[staticmethod]
    #[pyo3(signature = (fx, fy, cx, cy, width, height, *, k1 = 0.0, k2 = 0.0, k3 = 0.0, k4 = 0.0,
        dx = 0.0, dy = 0.0))]
    #[allow(clippy::too_many_arguments)]
    fn inverse_polynomial(
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        width: usize,
        height: usize,
        k1: f64,
        k2: f64,
        k3: f64,
        k4: f64,
        dx: f64,
        dy: f64,
    ) -> PyResult<Self> {
        Camera::inverse_polynomial(fx, fy, cx, cy, [k1, k2, k3, k4], width, height)
            .and_then(|camera| camera.with_distortion_centre(dx, dy))
            .into_python()
            .map(Self)
    }

    /// FOV fish-eye with parameter w in radians (1.6).
    #[staticmethod]
    #[pyo3(signature = (fx, fy, cx, cy, w, width, height, *, dx = 0.0, dy = 0.0))]
    #[allow(clippy::too_many_arguments)]
    fn fov(
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        w: f64,
        width: usize,
        height: usize,
        dx: f64,
        dy: f64,
    ) -> PyResult<Self> {
        Camera::fov(fx, fy, cx, cy, w, width, height)
            .and_then(|camera| camera.with_distortion_centre(dx, dy))
            .into_python()
            .map(Self)
    }

    /// Kannala and Brandt's fish-eye (OpenCV's fisheye).
    #[staticmethod]
    #[allow(clippy::too_many_arguments)]
    fn kannala_brandt(
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        k1: f64,
        k2: f64,
        k3: f64,
        k4: f64,
        width: usize,
        height: usize,
    ) -> PyResult<Self> {
        Camera::kannala_brandt(fx, fy, cx, cy, [k1, k2, k3, k4], width, height)
            .into_python()
            .map(Self)
    }

    /// Unified catadioptric model with alpha in [0, 1] (thesis 1.1.2).
    #[staticmethod]
    fn unified(
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        alpha: f64,
        width: usize,
        height: usize,
    ) -> PyResult<Self> {
        Camera::unified(fx, fy, cx, cy, alpha, width, height)
            .into_python()
            .map(Self)
    }

    /// Double sphere model.
    #[staticmethod]
    #[allow(clippy::too_many_arguments)]
    fn double_sphere(
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        xi: f64,
        alpha: f64,
        width: usize,
        height: usize,
    ) -> PyResult<Self> {
        Camera::double_sphere(fx, fy, cx, cy, [xi, alpha], width, height)
            .into_python()
            .map(Self)
    }

    /// The whole sphere by longitude and latitude.
    #[staticmethod]
    fn equirectangular(width: usize, height: usize) -> PyResult<Self> {
        Camera::equirectangular(width, height)
            .into_python()
            .map(Self)
    }

    /// Any model by its name and named parameters, as in a calibration file.
    #[staticmethod]
    fn from_parameters(
        model: &str,
        parameters: BTreeMap<String, f64>,
        width: usize,
        height: usize,
    ) -> PyResult<Self> {
        let parameters: Vec<(String, f64)> = parameters.into_iter().collect();
        Camera::from_named(model, &parameters, width, height)
            .into_python()
            .map(Self)
    }

    /// Name of the model.
    #[getter]
    fn model(&self) -> &'static str {
        self.0.model_name()
    }

    /// Parameters by name, as `from_parameters` takes them.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.0.named_parameters().into_py_dict(py)
    }

    /// The camera of the image binned `factor` x `factor`.
    fn binned(&self, factor: usize) -> PyResult<Self> {
        self.0.binned(factor).into_python().map(Self)
    }

    fn __repr__(&self) -> String {
        let parameters: Vec<String> = self
            .0
            .named_parameters()
            .iter()
            .map(|(name, value)| format!("{name}={value}"))
            .collect();
        let (width, height) = (self.0.width(), self.0.height());
        format!(
            "Camera({} {width}x{height}: {})",
            self.0.model_name(),
            parameters.join(", ")
        )
    }

    /// Pixels per row.
    #[getter]
    fn width(&self) -> usize {
        self.0.width()
    }

    /// Rows.
    #[getter]
    fn height(&self) -> usize {
        self.0.height()
    }

    /// Pixels that see points.
    ///
    /// Parameters
    /// ----------
    /// points_in_camera : array_like, (N, 3)
    ///     Points in the camera frame, any unit of length.
    ///
    /// Returns
    /// -------
    /// ndarray, (N, 2)
    ///     Pixel (column, row); NaN where the point is behind the camera, outside the model's domain or
    ///     outside the image.
    ///
    /// Raises
    /// ------
    /// ShapeError, DtypeError
    ///     Naming `points_in_camera`.
    fn project<'py>(
        &self,
        py: Python<'py>,
        points_in_camera: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points = vectors3(points_in_camera, "points_in_camera")?;
        let flat = points.iter().flat_map(|p| {
            let pixel = self.0.project(p).filter(|pixel| self.0.contains(pixel));
            pixel.map_or([f64::NAN; 2], |pixel| [pixel.x, pixel.y])
        });
        PyArray1::from_iter(py, flat).reshape([points.len(), 2])
    }

    /// Unit rays of pixels: the inverse of `project`, up to the length.
    ///
    /// Parameters
    /// ----------
    /// pixels : array_like, (N, 2)
    ///     Column and row; they may lie outside the image.
    ///
    /// Returns
    /// -------
    /// ndarray, (N, 3)
    ///     Unit vectors in the camera frame; NaN where the model has no ray.
    ///
    /// Raises
    /// ------
    /// ShapeError, DtypeError
    ///     Naming `pixels`.
    fn unproject<'py>(
        &self,
        py: Python<'py>,
        pixels: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let pixels = floats(pixels, "pixels", &[None, Some(2)])?;
        let (pixels, _) = pixels.as_slice()?.as_chunks::<2>();
        let flat = pixels.iter().flat_map(|&[u, v]| {
            self.0
                .unproject(&Vector2::new(u, v))
                .map_or([f64::NAN; 3], |r| [r.x, r.y, r.z])
        });
        PyArray1::from_iter(py, flat).reshape([pixels.len(), 3])
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        reduced(py, "Camera", self.0.to_plain(py)?)
    }
}
