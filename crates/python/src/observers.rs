//! `VelocityBiasEstimator` and `ImuBiasEstimator`: biases from images and from velocities.

use crate::arrays::{floats, metres};
use crate::attitude::{reason_text, unknown, vector3};
use crate::camera::PyCamera;
use crate::errors::IntoPython;
use nalgebra::{Matrix3, Vector3};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use sphereflow_core::{DepthMap, RangeMap};
use sphereflow_observers::imu_bias::{
    ImuBiasConfig, ImuBiasEstimator, ImuBiasMethod, ImuBiasState, VelocityMeasurement,
};
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
pub struct PyVelocityBiasState(VelocityBiasState);

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
/// max_width : int
///     Images are binned until they are at most this wide.
/// readout_s : float
///     Seconds from the first row of an image to the last: 0 for a global shutter, about 0.03 for a
///     Kinect.
/// timing_sigma_s : float
///     How well stamps of images and velocities agree, seconds.
#[pyclass(name = "VelocityBiasEstimator", module = "sphereflow.observers")]
pub struct PyVelocityBiasEstimator {
    inner: VelocityBiasEstimator,
    camera: sphereflow_sphere::Camera,
}

#[pymethods]
impl PyVelocityBiasEstimator {
    #[new]
    #[pyo3(signature = (camera, method = "information", *, k_field = 2.0, k_v = 1e-2,
        k_omega = 1e-5, lambda_y = 1.0, lambda_d = 5000.0, rate_per_s = 1.0, forget_s = 3.0,
        linear_sigma = 0.01, angular_sigma = 1e-3, max_width = 160, readout_s = 0.0,
        timing_sigma_s = 0.0))]
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
        max_width: usize,
        readout_s: f64,
        timing_sigma_s: f64,
    ) -> PyResult<Self> {
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
            max_width,
            readout_s,
            timing_sigma_s,
            ..VelocityBiasConfig::default()
        };
        Ok(Self {
            inner: VelocityBiasEstimator::new(&camera.0, config).into_python()?,
            camera: camera.0.clone(),
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
        let size = Some((self.camera.width(), self.camera.height()));
        let grey = metres(grey, "grey", size)?;
        let plane = metres(depth_m, "depth_m", size)?;
        let range = match along {
            "axis" => range_from_depth(&DepthMap::new(plane), &self.camera).into_python()?,
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

/// What is known of the IMU's biases after a sample; body frame.
#[pyclass(name = "ImuBiasState", module = "sphereflow.observers", frozen)]
pub struct PyImuBiasState(ImuBiasState);

#[pymethods]
impl PyImuBiasState {
    /// Velocity, m/s, (3,).
    #[getter]
    fn velocity_m_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, &self.0.velocity_m_s)
    }

    /// Gravity itself (downwards), m/s^2, (3,).
    #[getter]
    fn gravity_m_s2<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, &self.0.gravity_m_s2)
    }

    /// To be subtracted from the gyro, rad/s, (3,).
    #[getter]
    fn gyro_bias<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, &self.0.gyro_bias_rad_s)
    }

    /// To be subtracted from the accelerometer, m/s^2, (3,).
    #[getter]
    fn accel_bias<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, &self.0.accel_bias_m_s2)
    }

    /// Covariance [velocity, gravity, gyro bias, accelerometer bias], (12, 12); None for the observer.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let matrix = self.0.covariance;
        matrix.map(|m| square(py, m.as_slice(), 12)).transpose()
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
}

/// Biases of gyro and accelerometer, gravity and velocity from velocities measured in images (the
/// thesis's Chapter 7).
///
/// Parameters
/// ----------
/// method : {'ekf', 'observer'}
///     An extended Kalman filter, or the thesis's observer (7.4).
/// gravity_m_s2 : float
///     Local norm of gravity.
/// field_dot_down : float or None
///     Scalar product of the unit vectors of magnetic field and gravity (the sine of the dip);
///     None: the magnetometer is not used.
/// gyro_sigma_rad_s, accel_sigma_m_s2 : float
///     Standard deviations of one reading.
/// gyro_walk, accel_walk : float
///     How the biases wander, rad/s/sqrt(s), m/s^2/sqrt(s).
/// gyro_bias_sigma, accel_bias_sigma : float
///     Standard deviations of the biases at the start.
#[pyclass(name = "ImuBiasEstimator", module = "sphereflow.observers")]
pub struct PyImuBiasEstimator(ImuBiasEstimator);

#[pymethods]
impl PyImuBiasEstimator {
    #[new]
    #[pyo3(signature = (method = "ekf", *, gravity_m_s2 = 9.81, field_dot_down = None,
        gyro_sigma_rad_s = 2.5e-3, accel_sigma_m_s2 = 0.03, gyro_walk = 1e-5, accel_walk = 3e-4,
        gyro_bias_sigma = 0.05, accel_bias_sigma = 0.3))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        method: &str,
        gravity_m_s2: f64,
        field_dot_down: Option<f64>,
        gyro_sigma_rad_s: f64,
        accel_sigma_m_s2: f64,
        gyro_walk: f64,
        accel_walk: f64,
        gyro_bias_sigma: f64,
        accel_bias_sigma: f64,
    ) -> PyResult<Self> {
        let method = match method {
            "ekf" => ImuBiasMethod::Ekf,
            "observer" => ImuBiasMethod::Observer,
            other => return Err(unknown("method", "'ekf' or 'observer'", other)),
        };
        let config = ImuBiasConfig {
            method,
            gravity_m_s2,
            field_dot_down,
            gyro_sigma_rad_s,
            accel_sigma_m_s2,
            gyro_walk,
            accel_walk,
            gyro_bias_sigma,
            accel_bias_sigma,
            ..ImuBiasConfig::default()
        };
        ImuBiasEstimator::new(config).into_python().map(Self)
    }

    /// One sample, body frame.
    ///
    /// Parameters
    /// ----------
    /// gyro_rad_s, accel_m_s2 : array_like, (3,)
    ///     Angular rate; specific force.
    /// velocity_m_s, angular_rad_s : array_like, (3,), or None
    ///     Velocities from images at this instant.
    /// velocity_sigma, angular_sigma : float
    ///     Their standard deviations, m/s and rad/s.
    /// mag_ut : array_like, (3,), or None
    ///     Magnetic field, any unit.
    /// mean : bool
    ///     The velocities are means since the ones before (of two images), not of the instant.
    /// dt_s : float
    ///     Seconds since the sample before.
    #[pyo3(signature = (gyro_rad_s, accel_m_s2, velocity_m_s = None, angular_rad_s = None,
        mag_ut = None, *, velocity_sigma = 0.01, angular_sigma = 5e-3, mean = false, dt_s))]
    #[allow(clippy::too_many_arguments)]
    fn step(
        &mut self,
        gyro_rad_s: &Bound<'_, PyAny>,
        accel_m_s2: &Bound<'_, PyAny>,
        velocity_m_s: Option<&Bound<'_, PyAny>>,
        angular_rad_s: Option<&Bound<'_, PyAny>>,
        mag_ut: Option<&Bound<'_, PyAny>>,
        velocity_sigma: f64,
        angular_sigma: f64,
        mean: bool,
        dt_s: f64,
    ) -> PyResult<PyImuBiasState> {
        let gyro = vector3(gyro_rad_s, "gyro_rad_s")?;
        let accel = vector3(accel_m_s2, "accel_m_s2")?;
        let angular = angular_rad_s
            .map(|v| vector3(v, "angular_rad_s"))
            .transpose()?;
        let linear = velocity_m_s
            .map(|v| vector3(v, "velocity_m_s"))
            .transpose()?;
        let mag = mag_ut.map(|v| vector3(v, "mag_ut")).transpose()?;
        let velocity = linear.map(|linear| VelocityMeasurement {
            linear_m_s: linear,
            linear_covariance: Matrix3::identity() * (velocity_sigma * velocity_sigma),
            angular_rad_s: angular,
            angular_covariance: Matrix3::identity() * (angular_sigma * angular_sigma),
            is_mean: mean,
            is_mean_angular: mean,
        });
        let state = self
            .0
            .step(&gyro, &accel, velocity.as_ref(), mag.as_ref(), dt_s);
        Ok(PyImuBiasState(state))
    }

    /// The state after the last sample.
    #[getter]
    fn state(&self) -> PyImuBiasState {
        PyImuBiasState(self.0.state())
    }

    /// Directions of the body along which gravity and the accelerometer's bias are not told apart
    /// by the motion so far, (K, 3): Proposition 7.
    #[getter]
    fn blind_directions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let directions = self.0.excitation().blind_directions();
        let flat: Vec<f64> = directions.iter().flat_map(|d| d.iter().copied()).collect();
        PyArray1::from_vec(py, flat).reshape([directions.len(), 3])
    }
}

/// A 3x3 covariance, or a standard deviation for all axes.
pub fn covariance3(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Matrix3<f64>> {
    if let Ok(sigma) = value.extract::<f64>() {
        return Ok(Matrix3::identity() * (sigma * sigma));
    }
    let array = floats(value, name, &[Some(3), Some(3)])?;
    Ok(Matrix3::from_row_slice(array.as_slice()?))
}
