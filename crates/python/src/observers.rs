//! `VelocityBiasEstimator`: biases of velocities from images.

use crate::arrays::{floats, metres};
use crate::attitude::{reason_text, unknown, vector3};
use crate::camera::PyCamera;
use crate::errors::IntoPython;
use crate::pickle::{Reduced, reduced};
use crate::plain::Plain;
use nalgebra::{Matrix3, Vector3};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use sphereflow_core::{DepthMap, Plane, RangeMap};
use sphereflow_observers::velocity_bias::{
    BiasMethod, FixedGains, ImageVelocity, VelocityBiasConfig, VelocityBiasEstimator,
    VelocityBiasState,
};
use sphereflow_sphere::range_from_depth;

/// A vector as an array.
pub fn array1<'py>(py: Python<'py>, v: &Vector3<f64>) -> Bound<'py, PyArray1<f64>> {
    PyArray1::from_slice(py, v.as_slice())
}

/// A square symmetric matrix, flat, as an array.
pub fn square<'py>(py: Python<'py>, flat: &[f64], n: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_slice(py, flat).reshape([n, n])
}

/// What is known of the velocity biases after a pair of images.
#[pyclass(name = "VelocityBiasState", module = "sphereflow.observers", frozen)]
pub struct PyVelocityBiasState(pub VelocityBiasState);

#[pymethods]
impl PyVelocityBiasState {
    /// To be subtracted from the measured angular velocity, rad/s, (3,).
    #[getter]
    fn angular_rad_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, &self.0.angular_rad_s)
    }

    /// To be subtracted from the measured linear velocity, m/s, (3,); None before one was measured.
    #[getter]
    fn linear_m_s<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.0.linear_m_s.map(|v| array1(py, &v))
    }

    /// Covariance [angular, linear], (6, 6), of the information form; None for the observers.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let matrix = self.0.covariance;
        matrix.map(|m| square(py, m.as_slice(), 6)).transpose()
    }

    /// Directions [angular, linear] that the images do not show, (K, 6).
    #[getter]
    fn blind_directions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let directions = &self.0.blind_directions;
        let flat: Vec<f64> = directions.iter().flat_map(|d| d.iter().copied()).collect();
        PyArray1::from_vec(py, flat).reshape([directions.len(), 6])
    }

    /// The images' part of the observers' Lyapunov function.
    #[getter]
    fn field_energy(&self) -> Option<f64> {
        self.0.field_energy
    }

    /// 'starting', 'ok', 'weak' or 'skipped'.
    #[getter]
    fn status(&self) -> &'static str {
        self.0.status.name()
    }

    /// Why, where the status is not 'ok'.
    #[getter]
    fn reason(&self) -> Option<String> {
        reason_text(self.0.status.reason())
    }

    fn __repr__(&self) -> String {
        format!("VelocityBiasState({})", self.0.status)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        reduced(py, "VelocityBiasState", self.0.to_plain(py)?)
    }
}

/// Biases of measured velocities from brightness and depth images (the thesis's Chapter 5).
///
/// Parameters
/// ----------
/// camera : Camera
///     The camera of the images; a 360-degree one is the whole sphere.
/// method : {'information', 'observer', 'normalised'}
///     The information form, the thesis's observer with its own gains, or the same with gains
///     divided by the Gram matrix of the images.
/// k_field, k_v, k_omega, lambda_y, lambda_d : float
///     Gains of the observer, in the thesis's units.
/// rate_per_s : float
///     Rate of the normalised observer.
/// forget_s : float
///     Time constant with which the information form forgets.
/// linear_sigma, angular_sigma : float
///     Standard deviations of one measured velocity, m/s and rad/s.
/// linear_bias_sigma, angular_bias_sigma : float
///     Standard deviations of the biases at the start: of a calibrated gyro rather 0.05 rad/s.
/// max_width : int
///     Images are binned until they are at most this wide.
/// readout_s : float
///     Seconds from the first row of an image to the last: 0 for a global shutter, about 0.03 for a
///     Kinect.
/// timing_sigma_s : float
///     How well stamps of images and velocities agree, seconds.
/// shared_error_px : float
///     Error of an alignment that all its pixels share (lens, blur), pixels of the binned image.
/// max_gap_s : float
///     After longer steps the images before are of no use.
/// angular_limit_rad_s : float or None
///     Largest angular velocity that can be measured; None: 2000 deg/s.
#[pyclass(name = "VelocityBiasEstimator", module = "sphereflow.observers")]
pub struct PyVelocityBiasEstimator {
    inner: VelocityBiasEstimator,
    size: (usize, usize),
    /// Range of a depth of one metre.
    per_depth: Plane<f32>,
}

#[pymethods]
impl PyVelocityBiasEstimator {
    #[new]
    #[pyo3(signature = (camera, method = "information", *, k_field = 2.0, k_v = 1e-2,
        k_omega = 1e-5, lambda_y = 1.0, lambda_d = 5000.0, rate_per_s = 1.0, forget_s = 3.0,
        linear_sigma = 0.01, angular_sigma = 1e-3,
        linear_bias_sigma = 3.0, angular_bias_sigma = 0.2, max_width = 160, readout_s = 0.0,
        timing_sigma_s = 0.0, shared_error_px = 1.5, max_gap_s = 0.5,
        angular_limit_rad_s = None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        camera: &PyCamera,
        method: &str,
        k_field: f64,
        k_v: f64,
        k_omega: f64,
        lambda_y: f64,
        lambda_d: f64,
        rate_per_s: f64,
        forget_s: f64,
        linear_sigma: f64,
        angular_sigma: f64,
        linear_bias_sigma: f64,
        angular_bias_sigma: f64,
        max_width: usize,
        readout_s: f64,
        timing_sigma_s: f64,
        shared_error_px: f64,
        max_gap_s: f64,
        angular_limit_rad_s: Option<f64>,
    ) -> PyResult<Self> {
        let defaults = VelocityBiasConfig::default();
        let method = match method {
            "information" => BiasMethod::Information,
            "observer" => BiasMethod::Observer,
            "normalised" => BiasMethod::Normalised,
            other => {
                let expected = "'information', 'observer' or 'normalised'";
                return Err(unknown("method", expected, other));
            }
        };
        let config = VelocityBiasConfig {
            method,
            gains: FixedGains {
                k_field,
                k_v,
                k_omega,
                lambda_y,
                lambda_d,
            },
            rate_per_s,
            forget_s,
            linear_sigma,
            angular_sigma,
            linear_bias_sigma,
            angular_bias_sigma,
            max_width,
            readout_s,
            timing_sigma_s,
            shared_error_px,
            max_gap_s,
            angular_limit_rad_s: angular_limit_rad_s.unwrap_or(defaults.angular_limit_rad_s),
            ..defaults
        };
        Ok(Self {
            inner: VelocityBiasEstimator::new(&camera.0, config).into_python()?,
            per_depth: per_depth(&camera.0)?,
            size: (camera.0.width(), camera.0.height()),
        })
    }

    /// The images of an instant and the velocities measured since the images before.
    ///
    /// Parameters
    /// ----------
    /// grey : array_like of float, (H, W)
    ///     Brightness, any unit, NaN unknown.
    /// depth_m : array_like of float, (H, W)
    ///     Metres, NaN or 0 unknown.
    /// angular_rad_s, linear_m_s : array_like, (3,)
    ///     Means over `dt_s`, camera frame; `linear_m_s` may be None: unknown.
    /// dt_s : float
    ///     Seconds since the images before.
    /// along : {'axis', 'ray'}
    ///     What `depth_m` holds.
    #[pyo3(signature = (grey, depth_m, angular_rad_s, linear_m_s = None, *, dt_s, along = "axis"))]
    #[allow(clippy::too_many_arguments)]
    fn step(
        &mut self,
        py: Python<'_>,
        grey: &Bound<'_, PyAny>,
        depth_m: &Bound<'_, PyAny>,
        angular_rad_s: &Bound<'_, PyAny>,
        linear_m_s: Option<&Bound<'_, PyAny>>,
        dt_s: f64,
        along: &str,
    ) -> PyResult<PyVelocityBiasState> {
        let size = Some(self.size);
        let grey = metres(grey, "grey", size)?;
        let mut plane = metres(depth_m, "depth_m", size)?;
        let range = match along {
            "axis" => {
                let per_depth = self.per_depth.data().iter();
                let metres = plane.data_mut().iter_mut();
                metres.zip(per_depth).for_each(|(z, per)| *z *= per);
                RangeMap::new(plane)
            }
            "ray" => RangeMap::new(plane),
            other => return Err(unknown("along", "'axis' (depth) or 'ray' (range)", other)),
        };
        let velocity = ImageVelocity {
            angular_rad_s: vector3(angular_rad_s, "angular_rad_s")?,
            linear_m_s: linear_m_s.map(|v| vector3(v, "linear_m_s")).transpose()?,
        };
        py.detach(|| self.inner.step(&grey, &range, &velocity, dt_s))
            .into_python()
            .map(PyVelocityBiasState)
    }

    /// The state after the last images.
    #[getter]
    fn state(&self) -> PyVelocityBiasState {
        PyVelocityBiasState(self.inner.state())
    }
}

/// The range of each pixel where the depth along the axis is one metre.
fn per_depth(camera: &sphereflow_sphere::Camera) -> PyResult<Plane<f32>> {
    let ones = DepthMap::new(Plane::filled(camera.width(), camera.height(), 1.0));
    let range = range_from_depth(&ones, camera).into_python()?;
    Ok(range.into_plane())
}

/// A 3x3 covariance, or a standard deviation for all axes.
pub fn covariance3(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Matrix3<f64>> {
    if let Ok(sigma) = value.extract::<f64>() {
        return Ok(Matrix3::identity() * (sigma * sigma));
    }
    let array = floats(value, name, &[Some(3), Some(3)])?;
    Ok(Matrix3::from_row_slice(array.as_slice()?))
}
