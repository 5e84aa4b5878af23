//! `Camera`: every model behind one class.

use crate::arrays::{floats, vectors3};
use crate::errors::IntoPython;
use nalgebra::Vector2;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use sphereflow_sphere::Camera;

/// A central camera: a model and the size of its image.
#[pyclass(name = "Camera", module = "sphereflow", frozen, eq)]
#[derive(Clone, PartialEq)]
pub struct PyCamera(pub Camera);

#[pymethods]
impl PyCamera {
    /// Perspective camera with optional skew (thesis 1.4).
    #[staticmethod]
    #[pyo3(signature = (fx, fy, cx, cy, width, height))]
    fn pinhole(fx: f64, fy: f64, cx: f64, cy: f64, width: usize, height: usize) -> PyResult<Self> {
        Camera::pinhole(fx, fy, cx, cy, width, height)
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

    /// Pixels that see the points, NaN where not visible. (N, 3) -> (N, 2).
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

    /// Unit rays of pixels, NaN where the model has none. (N, 2) -> (N, 3).
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
}
