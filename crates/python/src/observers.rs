//! `VelocityBiasEstimator`: biases of velocities from images.

use crate::arguments::{reason_text, unknown, vector3};
use crate::arrays::{array1, metres, square};
use crate::camera::PyCamera;
use crate::config::{keywords, settings};
use crate::errors::IntoPython;
use crate::plain::reason_values;
use crate::plain::{Plain, named};
use crate::reduce::{Reduced, reduced};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sphereflow_core::ReasonCode;
use sphereflow_core::{DepthMap, Plane, RangeMap};
use sphereflow_observers::velocity_bias::{
    BiasMethod, ImageVelocity, VelocityBiasConfig, VelocityBiasEstimator, VelocityBiasState,
};
use sphereflow_sphere::range_from_depth;

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

    /// Stable code of the reason, in snake_case (docs/reason-codes.md); None where there is none.
    #[getter]
    fn reason_code(&self) -> Option<&'static str> {
        self.0.status.reason().map(|why| why.code())
    }

    /// The values that decided, by name; empty where there is no reason.
    #[getter]
    fn reason_values<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        reason_values(py, self.0.status.reason().as_ref())
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
/// method : {'information', 'observer', 'normalised'}, optional
///     The information form, the thesis's observer with its own gains, or the same with gains
///     divided by the Gram matrix of the images.
/// config : sphereflow.config.VelocityBiasConfig, optional
///     All settings. The other arguments, where given, replace what it says.
/// k_field, k_v, k_omega, lambda_y, lambda_d : float, optional
///     Gains of the observer, in the thesis's units.
/// rate_per_s : float, optional
///     Rate of the normalised observer.
/// forget_s : float, optional
///     Time constant with which the information form forgets.
/// linear_sigma, angular_sigma : float, optional
///     Standard deviations of one measured velocity, m/s and rad/s.
/// linear_bias_sigma, angular_bias_sigma : float, optional
///     Standard deviations of the biases at the start: of a calibrated gyro rather 0.05 rad/s.
/// max_width : int, optional
///     Images are binned until they are at most this wide.
/// readout_s : float, optional
///     Seconds from the first row of an image to the last: 0 for a global shutter, about 0.03 for a
///     Kinect.
/// timing_sigma_s : float, optional
///     How well stamps of images and velocities agree, seconds.
/// shared_error_px : float, optional
///     Error of an alignment that all its pixels share (lens, blur), pixels of the binned image.
/// max_gap_s : float, optional
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
    #[pyo3(signature = (camera, method = None, *, config = None, k_field = None, k_v = None, k_omega = None, lambda_y = None, lambda_d = None, rate_per_s = None, forget_s = None, linear_sigma = None, angular_sigma = None, linear_bias_sigma = None, angular_bias_sigma = None, max_width = None, readout_s = None, timing_sigma_s = None, shared_error_px = None, max_gap_s = None, angular_limit_rad_s = None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        camera: &PyCamera,
        method: Option<&str>,
        config: Option<&Bound<'_, PyAny>>,
        k_field: Option<f64>,
        k_v: Option<f64>,
        k_omega: Option<f64>,
        lambda_y: Option<f64>,
        lambda_d: Option<f64>,
        rate_per_s: Option<f64>,
        forget_s: Option<f64>,
        linear_sigma: Option<f64>,
        angular_sigma: Option<f64>,
        linear_bias_sigma: Option<f64>,
        angular_bias_sigma: Option<f64>,
        max_width: Option<usize>,
        readout_s: Option<f64>,
        timing_sigma_s: Option<f64>,
        shared_error_px: Option<f64>,
        max_gap_s: Option<f64>,
        angular_limit_rad_s: Option<f64>,
    ) -> PyResult<Self> {
        let mut config: VelocityBiasConfig = settings(config)?;
        let method = method.map(|word| named::<BiasMethod>(word, "method"));
        keywords!(config {
            method = method.transpose()?,
            gains.k_field = k_field,
            gains.k_v = k_v,
            gains.k_omega = k_omega,
            gains.lambda_y = lambda_y,
            gains.lambda_d = lambda_d,
            rate_per_s = rate_per_s,
            forget_s = forget_s,
            linear_sigma = linear_sigma,
            angular_sigma = angular_sigma,
            linear_bias_sigma = linear_bias_sigma,
            angular_bias_sigma = angular_bias_sigma,
            max_width = max_width,
            readout_s = readout_s,
            timing_sigma_s = timing_sigma_s,
            shared_error_px = shared_error_px,
            max_gap_s = max_gap_s,
            angular_limit_rad_s = angular_limit_rad_s,
        });
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
