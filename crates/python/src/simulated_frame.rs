//! `SimulatedFrame` and the iterator over frames drawn ahead.

use crate::errors::IntoPython;
use crate::trajectory::pose_matrix;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use sphereflow_core::Plane;
use sphereflow_sim::{Error, SimulatedFrame};
use std::sync::mpsc::Receiver;
use std::sync::{Mutex, PoisonError};

/// A plane as an (H, W) array.
pub fn image<'py, T: numpy::Element + Clone>(
    py: Python<'py>,
    plane: &Plane<T>,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let (width, height) = plane.size();
    PyArray1::from_slice(py, plane.data()).reshape([height, width])
}

/// An RGB plane as an (H, W, 3) array.
pub fn rgb<'py>(py: Python<'py>, plane: &Plane<[u8; 3]>) -> PyResult<Bound<'py, PyArray3<u8>>> {
    let (width, height) = plane.size();
    PyArray1::from_slice(py, plane.data().as_flattened()).reshape([height, width, 3])
}

/// A simulated frame: what the sensors say, and the exact truth beside it.
#[pyclass(name = "SimulatedFrame", module = "sphereflow.sim", frozen)]
pub struct PySimulatedFrame(SimulatedFrame);

#[pymethods]
impl PySimulatedFrame {
    /// Stamp, integer nanoseconds.
    #[getter]
    fn stamp_ns(&self) -> i64 {
        self.0.frame.stamp.ns()
    }

    /// RGB image with the camera's noise, uint8 (H, W, 3).
    #[getter]
    fn colour<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray3<u8>>>> {
        self.0
            .frame
            .colour
            .as_ref()
            .map(|plane| rgb(py, plane))
            .transpose()
    }

    /// Depth with the camera's noise, metres, float32 (H, W), NaN unknown.
    #[getter]
    fn depth_m<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f32>>>> {
        self.0
            .frame
            .depth
            .as_ref()
            .map(|map| image(py, map.metres()))
            .transpose()
    }

    /// Range along the ray with the camera's noise, metres, float32 (H, W): what a 360-degree camera
    /// has instead of depth; None for other cameras.
    #[getter]
    fn range_m<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f32>>>> {
        self.0
            .frame
            .range
            .as_ref()
            .map(|map| image(py, map.metres()))
            .transpose()
    }

    /// Exact depth along the optical axis, metres, float32 (H, W).
    #[getter]
    fn exact_depth_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        image(py, self.0.exact.depth.metres())
    }

    /// Exact range along the ray, metres, float32 (H, W).
    #[getter]
    fn exact_range_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        image(py, self.0.exact.range.metres())
    }

    /// Exact brightness, not quantised, float32 (H, W).
    #[getter]
    fn exact_grey<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        image(py, &self.0.exact.grey)
    }

    /// True pose of the camera, (4, 4).
    #[getter]
    fn world_from_camera<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        pose_matrix(py, &self.0.state.world_from_camera)
    }

    /// True linear velocity, m/s, camera frame, (3,).
    #[getter]
    fn linear_m_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.0.state.twist.linear_m_s.as_slice())
    }

    /// True angular velocity, rad/s, camera frame, (3,).
    #[getter]
    fn angular_rad_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.0.state.twist.angular_rad_s.as_slice())
    }
}

/// Frames in order, drawn ahead on a thread of their own.
#[pyclass(name = "SimulatedFrames", module = "sphereflow.sim")]
pub struct PySimulatedFrames(pub Mutex<Receiver<Result<SimulatedFrame, Error>>>);

#[pymethods]
impl PySimulatedFrames {
    fn __iter__(this: PyRef<'_, Self>) -> PyRef<'_, Self> {
        this
    }

    fn __next__(&mut self, py: Python<'_>) -> PyResult<Option<PySimulatedFrame>> {
        let frames = self.0.get_mut().unwrap_or_else(PoisonError::into_inner);
        match py.detach(move || frames.recv()) {
            Err(_) => Ok(None), // the drawing thread is done
            Ok(frame) => frame.into_python().map(PySimulatedFrame).map(Some),
        }
    }
}
