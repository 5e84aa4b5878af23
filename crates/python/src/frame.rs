//! `Frame` and the iterator over frames decoded ahead.

use crate::errors::IntoPython;
use crate::plain::{dict_of, item};
use crate::reduce::{Reduced, reduced};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sphereflow_core::{Plane, RgbdFrame, Stamp};
use sphereflow_io::recording::FrameStream;
use std::sync::{Mutex, PoisonError};

/// One RGB-D frame.
#[pyclass(name = "Frame", module = "sphereflow.io", frozen)]
pub struct PyFrame {
    stamp_ns: i64,
    colour: Option<Py<PyArray3<u8>>>,
    depth_m: Option<Py<PyArray2<f32>>>,
    range_m: Option<Py<PyArray2<f32>>>,
    imu_count: usize,
}

impl PyFrame {
    /// The images move into NumPy arrays without a copy.
    pub fn new(py: Python<'_>, frame: RgbdFrame) -> PyResult<Self> {
        let colour = frame.colour.map(|plane| {
            let (width, height) = plane.size();
            let flat = plane.into_vec().into_flattened();
            PyArray1::from_vec(py, flat)
                .reshape([height, width, 3])
                .map(Bound::unbind)
        });
        let metres = |plane: Plane<f32>| {
            let (width, height) = plane.size();
            PyArray1::from_vec(py, plane.into_vec())
                .reshape([height, width])
                .map(Bound::unbind)
        };
        let depth_m = frame.depth.map(|map| metres(map.into_plane()));
        let range_m = frame.range.map(|map| metres(map.into_plane()));
        Ok(Self {
            stamp_ns: frame.stamp.ns(),
            colour: colour.transpose()?,
            depth_m: depth_m.transpose()?,
            range_m: range_m.transpose()?,
            imu_count: frame.imu.len(),
        })
    }

    /// From the state that `__reduce__` gives.
    pub fn from_state(state: &Bound<'_, PyAny>) -> PyResult<Self> {
        let dict = dict_of(state)?;
        Ok(Self {
            stamp_ns: item(dict, "stamp_ns")?.extract()?,
            colour: item(dict, "colour")?.extract::<Option<Py<PyArray3<u8>>>>()?,
            depth_m: item(dict, "depth_m")?.extract::<Option<Py<PyArray2<f32>>>>()?,
            range_m: item(dict, "range_m")?.extract::<Option<Py<PyArray2<f32>>>>()?,
            imu_count: item(dict, "imu_count")?.extract()?,
        })
    }
}

#[pymethods]
impl PyFrame {
    /// Stamp, integer nanoseconds.
    #[getter]
    fn stamp_ns(&self) -> i64 {
        self.stamp_ns
    }

    /// RGB image, uint8 (H, W, 3); None where the frame has none.
    #[getter]
    fn colour(&self, py: Python<'_>) -> Option<Py<PyArray3<u8>>> {
        self.colour.as_ref().map(|array| array.clone_ref(py))
    }

    /// Depth along the optical axis, metres, float32 (H, W), NaN unknown; None where there is none.
    #[getter]
    fn depth_m(&self, py: Python<'_>) -> Option<Py<PyArray2<f32>>> {
        self.depth_m.as_ref().map(|array| array.clone_ref(py))
    }

    /// Range along the ray, metres, float32 (H, W), NaN unknown: what a 360-degree camera has
    /// instead of depth; None for other cameras.
    #[getter]
    fn range_m(&self, py: Python<'_>) -> Option<Py<PyArray2<f32>>> {
        self.range_m.as_ref().map(|array| array.clone_ref(py))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        let state = PyDict::new(py);
        state.set_item("stamp_ns", self.stamp_ns)?;
        state.set_item("colour", &self.colour)?;
        state.set_item("depth_m", &self.depth_m)?;
        state.set_item("range_m", &self.range_m)?;
        state.set_item("imu_count", self.imu_count)?;
        reduced(py, "Frame", state.into_any())
    }

    fn __repr__(&self) -> String {
        let has = |there: bool| if there { "yes" } else { "no" };
        format!(
            "Frame({} s, colour: {}, depth: {}, {} inertial samples)",
            Stamp::from_ns(self.stamp_ns),
            has(self.colour.is_some()),
            has(self.depth_m.is_some() || self.range_m.is_some()),
            self.imu_count
        )
    }
}

/// Frames in order, decoded ahead on worker threads.
#[pyclass(name = "FrameIterator", module = "sphereflow.io")]
pub struct PyFrameIterator(pub Mutex<FrameStream>); // a stream's channels are not shared between threads

#[pymethods]
impl PyFrameIterator {
    fn __iter__(this: PyRef<'_, Self>) -> PyRef<'_, Self> {
        this
    }

    /// The next frame. A frame that cannot be read raises; the call after it goes on.
    fn __next__(&mut self, py: Python<'_>) -> PyResult<Option<PyFrame>> {
        let stream = self.0.get_mut().unwrap_or_else(PoisonError::into_inner);
        match py.detach(|| stream.next()) {
            None => Ok(None),
            Some(frame) => PyFrame::new(py, frame.into_python()?).map(Some),
        }
    }
}
