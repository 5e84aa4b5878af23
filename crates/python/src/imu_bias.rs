//! `ImuBiasEstimator`: biases of gyro and accelerometer from velocities, sample by sample and of a
//! whole recording.

mod samples;

use crate::arguments::{reason_text, vector3};
use crate::arrays::{array1, square};
use crate::config::{keywords, settings};
use crate::errors::{IntoPython, core_error};
use crate::plain::reason_values;
use crate::plain::{Plain, named};
use crate::reduce::{Reduced, reduced};
use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use pyo3::types::PyList;
use samples::{measured, samples};
use sphereflow_core::ReasonCode;
use sphereflow_observers::Status;
use sphereflow_observers::imu_bias::{
    ImuBiasConfig, ImuBiasEstimator, ImuBiasMethod, ImuBiasRun, ImuBiasState,
};

/// The answers for a recording.
#[pyclass(name = "ImuBiasRun", module = "sphereflow.observers", frozen)]
pub struct PyImuBiasRun(pub ImuBiasRun);

impl PyImuBiasRun {
    fn rows<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&ImuBiasState) -> Vector3<f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let states = &self.0.states;
        let flat: Vec<f64> = states
            .iter()
            .flat_map(|s| <[f64; 3]>::from(of(s)))
            .collect();
        PyArray1::from_vec(py, flat).reshape([states.len(), 3])
    }
}

#[pymethods]
impl PyImuBiasRun {
    /// Index of the sample of each state, (M,).
    #[getter]
    fn sample<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_iter(py, self.0.samples.iter().map(|i| *i as i64))
    }

    /// Velocities, m/s, (M, 3).
    #[getter]
    fn velocity_m_s<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, |s| s.velocity_m_s)
    }

    /// Gravity itself (downwards), m/s^2, (M, 3).
    #[getter]
    fn gravity_m_s2<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, |s| s.gravity_m_s2)
    }

    /// To be subtracted from the gyro, rad/s, (M, 3).
    #[getter]
    fn gyro_bias<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, |s| s.gyro_bias_rad_s)
    }

    /// To be subtracted from the accelerometer, m/s^2, (M, 3).
    #[getter]
    fn accel_bias<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, |s| s.accel_bias_m_s2)
    }

    /// 'starting', 'ok', 'weak' or 'skipped' for each state.
    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        PyList::new(py, self.0.states.iter().map(|s| Status::name(&s.status)))
    }

    /// The reason for each state, None where all is well.
    #[getter]
    fn reason<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let reasons = self.0.states.iter().map(|s| reason_text(s.status.reason()));
        PyList::new(py, reasons)
    }

    /// The reason's code for each state, None where all is well.
    #[getter]
    fn reason_code<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let codes = self.0.states.iter().map(|s| s.status.reason());
        PyList::new(py, codes.map(|why| why.map(|why| why.code())))
    }

    fn __len__(&self) -> usize {
        self.0.states.len()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        reduced(py, "ImuBiasRun", self.0.to_plain(py)?)
    }
}

/// What is known of the IMU's biases after a sample; body frame.
#[pyclass(name = "ImuBiasState", module = "sphereflow.observers", frozen)]
pub struct PyImuBiasState(pub ImuBiasState);

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

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        reduced(py, "ImuBiasState", self.0.to_plain(py)?)
    }
}

/// Biases of gyro and accelerometer, gravity and velocity from velocities measured in images (the
/// thesis's Chapter 7).
///
/// Parameters
/// ----------
/// method : {'ekf', 'observer'}, optional
///     An extended Kalman filter, or the thesis's observer (7.4).
/// config : sphereflow.config.ImuBiasConfig, optional
///     All settings. The other arguments, where given, replace what it says.
/// gravity_m_s2 : float, optional
///     Local norm of gravity.
/// field_dot_down : float or None
///     Scalar product of the unit vectors of magnetic field and gravity (the sine of the dip);
///     None: the magnetometer is not used.
/// gyro_sigma_rad_s, accel_sigma_m_s2 : float or None
///     Standard deviations of one reading; None, here and below: of a consumer-grade sensor.
/// gyro_walk, accel_walk : float or None
///     How the biases wander, rad/s/sqrt(s), m/s^2/sqrt(s).
/// gyro_bias_sigma, accel_bias_sigma : float or None
///     Standard deviations of the biases at the start.
#[pyclass(name = "ImuBiasEstimator", module = "sphereflow.observers")]
pub struct PyImuBiasEstimator(ImuBiasEstimator);

#[pymethods]
impl PyImuBiasEstimator {
    #[new]
    #[pyo3(signature = (method = None, *, config = None, gravity_m_s2 = None,
        field_dot_down = None, gyro_sigma_rad_s = None, accel_sigma_m_s2 = None, gyro_walk = None,
        accel_walk = None, gyro_bias_sigma = None, accel_bias_sigma = None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        method: Option<&str>,
        config: Option<&Bound<'_, PyAny>>,
        gravity_m_s2: Option<f64>,
        field_dot_down: Option<f64>,
        gyro_sigma_rad_s: Option<f64>,
        accel_sigma_m_s2: Option<f64>,
        gyro_walk: Option<f64>,
        accel_walk: Option<f64>,
        gyro_bias_sigma: Option<f64>,
        accel_bias_sigma: Option<f64>,
    ) -> PyResult<Self> {
        let mut config: ImuBiasConfig = settings(config)?;
        let method = method.map(|word| named::<ImuBiasMethod>(word, "method"));
        keywords!(config {
            method = method.transpose()?,
            gravity_m_s2 = gravity_m_s2,
            field_dot_down = field_dot_down.map(Some),
            gyro_sigma_rad_s = gyro_sigma_rad_s,
            accel_sigma_m_s2 = accel_sigma_m_s2,
            gyro_walk = gyro_walk,
            accel_walk = accel_walk,
            gyro_bias_sigma = gyro_bias_sigma,
            accel_bias_sigma = accel_bias_sigma,
        });
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
        let sigmas = [velocity_sigma, angular_sigma];
        let velocity = linear.map(|linear| measured(linear, angular, sigmas, mean));
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

    /// All samples in order, going on from the present state.
    ///
    /// Parameters
    /// ----------
    /// stamp_ns : array_like of int, (N,)
    ///     Stamps.
    /// gyro_rad_s, accel_m_s2 : array_like, (N, 3)
    ///     Angular rates, specific forces.
    /// velocity_m_s : array_like, (N, 3)
    ///     Velocities from images; rows of NaN are instants without one.
    /// angular_rad_s, mag_ut : array_like, (N, 3), or None
    ///     Angular velocities from images (of the rows with a velocity), magnetic fields; NaN: none.
    /// velocity_sigma, angular_sigma, mean
    ///     As of `step`.
    /// smooth : bool
    ///     Every state from the whole recording (fixed-interval smoother), one for each sample with
    ///     a velocity or a field. Begins anew and leaves the estimator's own state alone.
    /// loops : int
    ///     So many times over, each from the biases of the time before (the thesis's section 7.7);
    ///     the last run is returned. More than one begins anew, as `smooth` does.
    #[pyo3(signature = (stamp_ns, gyro_rad_s, accel_m_s2, velocity_m_s, angular_rad_s = None,
        mag_ut = None, *, velocity_sigma = 0.01, angular_sigma = 5e-3, mean = false,
        smooth = false, loops = 1))]
    #[allow(clippy::too_many_arguments)]
    fn run(
        &mut self,
        py: Python<'_>,
        stamp_ns: &Bound<'_, PyAny>,
        gyro_rad_s: &Bound<'_, PyAny>,
        accel_m_s2: &Bound<'_, PyAny>,
        velocity_m_s: &Bound<'_, PyAny>,
        angular_rad_s: Option<&Bound<'_, PyAny>>,
        mag_ut: Option<&Bound<'_, PyAny>>,
        velocity_sigma: f64,
        angular_sigma: f64,
        mean: bool,
        smooth: bool,
        loops: usize,
    ) -> PyResult<PyImuBiasRun> {
        let (a, b, c) = (Some(gyro_rad_s), Some(accel_m_s2), Some(velocity_m_s));
        let columns = [a, b, c, angular_rad_s, mag_ut];
        let samples = samples(stamp_ns, columns, [velocity_sigma, angular_sigma], mean)?;
        if loops == 0 || (smooth && loops > 1) {
            let expected = "1 or more, and 1 with smooth";
            let error = sphereflow_core::Error::value("loops", expected, loops);
            return Err(core_error(&error));
        }
        let config = *self.0.config();
        py.detach(|| match (smooth, loops) {
            (true, _) => ImuBiasEstimator::smooth(config, &samples),
            (false, 1) => Ok(self.0.run(&samples)),
            (false, times) => ImuBiasEstimator::loops(config, &samples, times),
        })
        .into_python()
        .map(PyImuBiasRun)
    }
}
