//! `SphereGrid`: a camera sampled on its pixels, with the calculus of the sphere.

use crate::arrays::floats;
use crate::camera::PyCamera;
use crate::errors::IntoPython;
use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use sphereflow_sphere::SphereGrid;

/// A camera sampled on its pixels: rays, solid angles, and the calculus of the unit sphere.
///
/// A pixel is the spherical polygon between its corner rays, so the solid angles of a 360-degree image
/// add up to 4 pi, and the sum of divergence times solid angle over any set of pixels is the flux
/// through its border (Gauss), both to rounding. The operators are of second order for every camera
/// model, up to the poles of a 360-degree image. At the image border one-sided values are
/// extrapolated. A NaN pixel spreads to its neighbours only (up to three pixels beside a border).
///
/// Parameters
/// ----------
/// camera : Camera
///     Any model. A pixel whose centre or corners have no ray is NaN in every result.
#[pyclass(name = "SphereGrid", module = "sphereflow", frozen)]
pub struct PySphereGrid(SphereGrid);

impl PySphereGrid {
    fn shape(&self) -> (usize, usize) {
        (self.0.height(), self.0.width())
    }

    fn scalar_field(&self, value: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<f64>> {
        let (height, width) = self.shape();
        Ok(floats(value, name, &[Some(height), Some(width)])?
            .as_slice()?
            .to_vec())
    }

    fn scalar_array<'py>(
        &self,
        py: Python<'py>,
        field: Vec<f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (height, width) = self.shape();
        PyArray1::from_vec(py, field).reshape([height, width])
    }

    fn vector_array<'py>(
        &self,
        py: Python<'py>,
        field: &[Vector3<f64>],
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let (height, width) = self.shape();
        let flat: Vec<f64> = field.iter().flat_map(|v| [v.x, v.y, v.z]).collect();
        PyArray1::from_vec(py, flat).reshape([height, width, 3])
    }
}

#[pymethods]
impl PySphereGrid {
    #[new]
    fn new(py: Python<'_>, camera: &PyCamera) -> PyResult<Self> {
        py.detach(|| SphereGrid::new(&camera.0))
            .into_python()
            .map(Self)
    }

    /// The camera that is sampled.
    #[getter]
    fn camera(&self) -> PyCamera {
        PyCamera(self.0.camera().clone())
    }

    /// Unit rays of the pixel centres, camera frame, (H, W, 3); NaN where a pixel has no ray.
    #[getter]
    fn rays<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        self.vector_array(py, self.0.rays())
    }

    /// Solid angle of each pixel, steradians, (H, W); NaN where a pixel has no ray.
    #[getter]
    fn solid_angle<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.scalar_array(py, self.0.solid_angle().to_vec())
    }

    /// Gradient of a scalar field.
    ///
    /// Parameters
    /// ----------
    /// f : array_like, (H, W)
    ///     One value a pixel; NaN is unknown.
    ///
    /// Returns
    /// -------
    /// ndarray, (H, W, 3)
    ///     Tangent vectors in the camera frame, unit of `f` per radian.
    fn gradient<'py>(
        &self,
        py: Python<'py>,
        f: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let f = self.scalar_field(f, "f")?;
        let gradient = py.detach(|| self.0.gradient(&f)).into_python()?;
        self.vector_array(py, &gradient)
    }

    /// Divergence of a tangent field.
    ///
    /// Parameters
    /// ----------
    /// u : array_like, (H, W, 3)
    ///     Tangent vectors in the camera frame; NaN is unknown.
    ///
    /// Returns
    /// -------
    /// ndarray, (H, W)
    ///     Unit of `u` per radian.
    fn divergence<'py>(
        &self,
        py: Python<'py>,
        u: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (height, width) = self.shape();
        let u = floats(u, "u", &[Some(height), Some(width), Some(3)])?;
        let u: Vec<Vector3<f64>> = u
            .as_slice()?
            .chunks_exact(3)
            .map(Vector3::from_column_slice)
            .collect();
        let divergence = py.detach(|| self.0.divergence(&u)).into_python()?;
        self.scalar_array(py, divergence)
    }

    /// Laplacian (Laplace-Beltrami) of a scalar field: the operator of the thesis's (2.16).
    ///
    /// Parameters
    /// ----------
    /// f : array_like, (H, W)
    ///     One value a pixel; NaN is unknown.
    ///
    /// Returns
    /// -------
    /// ndarray, (H, W)
    ///     Unit of `f` per square radian.
    fn laplacian<'py>(
        &self,
        py: Python<'py>,
        f: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let f = self.scalar_field(f, "f")?;
        let laplacian = py.detach(|| self.0.laplacian(&f)).into_python()?;
        self.scalar_array(py, laplacian)
    }

    fn __repr__(&self) -> String {
        let (height, width) = self.shape();
        format!(
            "SphereGrid({} camera, {width}x{height})",
            self.0.camera().model_name()
        )
    }
}
