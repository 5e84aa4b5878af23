//! `AttitudeFilter` and `VisualAttitude`: attitude from inertial samples and from vision.

use crate::arguments::{reason_text, rotation_from, vector3};
use crate::arrays::{array1, floats, stamps, xyzw};
use crate::config::{keywords, settings};
use crate::errors::IntoPython;
use crate::plain::reason_values;
use crate::plain::{Plain, named};
use crate::reduce::{Reduced, reduced};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use pyo3::types::PyList;
use sphereflow_core::ReasonCode;
use sphereflow_observers::Status;
use sphereflow_observers::attitude::{
    AttitudeConfig, AttitudeFilter, AttitudeRun, AttitudeState, Method, VisualAttitude, World,
};

/// What the filter says after a sample.
#[pyclass(name = "AttitudeState", module = "sphereflow.attitude", frozen)]
pub struct PyAttitudeState(pub AttitudeState);

#[pymethods]
impl PyAttitudeState {
    /// Attitude, world from body, (4,).
    #[getter]
    fn quat_xyzw<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &xyzw(&self.0.world_from_body))
    }

    /// To be subtracted from the gyro, rad/s, (3,).
    #[getter]
    fn gyro_bias<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, &self.0.gyro_bias_rad_s)
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

    /// True where neither gyro nor accelerometer moves.
    #[getter]
    fn at_rest(&self) -> bool {
        self.0.at_rest
    }

    /// True where the magnetic field is left out as disturbed.
    #[getter]
    fn mag_disturbed(&self) -> bool {
        self.0.mag_disturbed
    }

    fn __repr__(&self) -> String {
        format!("AttitudeState({})", self.0.status)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        reduced(py, "AttitudeState", self.0.to_plain(py)?)
    }
}

/// The answers for a whole recording.
#[pyclass(name = "AttitudeRun", module = "sphereflow.attitude", frozen)]
pub struct PyAttitudeRun(pub AttitudeRun);

#[pymethods]
impl PyAttitudeRun {
    /// Attitudes, world from body, (N, 4).
    #[getter]
    fn quat_xyzw<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let flat: Vec<f64> = self.0.world_from_body.iter().flat_map(xyzw).collect();
        PyArray1::from_vec(py, flat).reshape([self.0.status.len(), 4])
    }

    /// Gyro biases, rad/s, (N, 3).
    #[getter]
    fn gyro_bias<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let biases = &self.0.gyro_bias_rad_s;
        let flat: Vec<f64> = biases.iter().flat_map(|b| [b.x, b.y, b.z]).collect();
        PyArray1::from_vec(py, flat).reshape([biases.len(), 3])
    }

    /// 'starting', 'ok', 'weak' or 'skipped' for each sample.
    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        PyList::new(py, self.0.status.iter().map(Status::name))
    }

    /// The reason for each sample, None where all is well.
    #[getter]
    fn reason<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        PyList::new(py, self.0.status.iter().map(|s| reason_text(s.reason())))
    }

    /// The reason's code for each sample, None where all is well.
    #[getter]
    fn reason_code<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let codes = self.0.status.iter().map(|s| s.reason());
        PyList::new(py, codes.map(|why| why.map(|why| why.code())))
    }

    /// True where nothing moves, (N,).
    #[getter]
    fn at_rest<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_slice(py, &self.0.at_rest)
    }

    /// True where the magnetic field is left out, (N,).
    #[getter]
    fn mag_disturbed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_slice(py, &self.0.mag_disturbed)
    }

    fn __len__(&self) -> usize {
        self.0.status.len()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        reduced(py, "AttitudeRun", self.0.to_plain(py)?)
    }
}

/// Attitude and gyro bias from gyro, accelerometer and, where there is one, magnetometer.
///
/// Parameters
/// ----------
/// method : {'inertial', 'invariant'}, optional
///     The estimator of today's standard, or the invariant observer of the thesis's section 9.4.
/// config : sphereflow.config.AttitudeConfig, optional
///     All settings. The other arguments, where given, replace what it says.
/// world : {'enu', 'rdf'}, optional
///     Frame of the answers: x east, y magnetic north, z up; or x east, y down, z north.
/// tau_accel_s, tau_mag_s : float, optional
///     Time constants of the corrections of inclination and heading, seconds.
/// motion_bias, rest_bias, reject_disturbance : bool, optional
///     Estimate the gyro's bias in motion, at rest; leave out a disturbed field.
/// gyro_limit_rad_s : float, optional
///     Largest rate that the gyro can read.
/// max_gap_s : float, optional
///     Longer time steps are gaps.
#[pyclass(name = "AttitudeFilter", module = "sphereflow.attitude")]
pub struct PyAttitudeFilter(AttitudeFilter);

#[pymethods]
impl PyAttitudeFilter {
    #[new]
    #[pyo3(signature = (method = None, *, config = None, world = None, tau_accel_s = None,
        tau_mag_s = None, motion_bias = None, rest_bias = None, reject_disturbance = None,
        gyro_limit_rad_s = None, max_gap_s = None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        method: Option<&str>,
        config: Option<&Bound<'_, PyAny>>,
        world: Option<&str>,
        tau_accel_s: Option<f64>,
        tau_mag_s: Option<f64>,
        motion_bias: Option<bool>,
        rest_bias: Option<bool>,
        reject_disturbance: Option<bool>,
        gyro_limit_rad_s: Option<f64>,
        max_gap_s: Option<f64>,
    ) -> PyResult<Self> {
        let mut config: AttitudeConfig = settings(config)?;
        let method = method.map(|word| named::<Method>(word, "method"));
        let world = world.map(|word| named::<World>(word, "world"));
        keywords!(config {
            method = method.transpose()?,
            world = world.transpose()?,
            tau_accel_s = tau_accel_s,
            tau_mag_s = tau_mag_s,
            motion_bias = motion_bias,
            rest_bias = rest_bias,
            reject_disturbance = reject_disturbance,
            gyro_limit_rad_s = gyro_limit_rad_s,
            max_gap_s = max_gap_s,
        });
        AttitudeFilter::new(config).into_python().map(Self)
    }

    /// One sample, body frame.
    ///
    /// Parameters
    /// ----------
    /// gyro_rad_s, accel_m_s2 : array_like, (3,)
    ///     Angular rate; specific force (at rest it points up with norm 9.81).
    /// mag_ut : array_like, (3,), or None
    ///     Magnetic field, microtesla.
    /// dt_s : float
    ///     Seconds since the sample before.
    #[pyo3(signature = (gyro_rad_s, accel_m_s2, mag_ut = None, *, dt_s))]
    fn step(
        &mut self,
        gyro_rad_s: &Bound<'_, PyAny>,
        accel_m_s2: &Bound<'_, PyAny>,
        mag_ut: Option<&Bound<'_, PyAny>>,
        dt_s: f64,
    ) -> PyResult<PyAttitudeState> {
        let gyro = vector3(gyro_rad_s, "gyro_rad_s")?;
        let accel = vector3(accel_m_s2, "accel_m_s2")?;
        let mag = mag_ut.map(|m| vector3(m, "mag_ut")).transpose()?;
        Ok(PyAttitudeState(self.0.step(
            &gyro,
            &accel,
            mag.as_ref(),
            dt_s,
        )))
    }

    /// All samples in order, going on from the present state.
    ///
    /// Parameters
    /// ----------
    /// gyro_rad_s, accel_m_s2 : array_like, (N, 3)
    ///     Angular rates, specific forces.
    /// mag_ut : array_like, (N, 3), or None
    ///     Magnetic fields; rows of NaN are instants without a reading.
    /// stamp_ns : array_like of int, (N,)
    ///     Stamps; one that does not increase is a skipped sample.
    ///
    /// Returns
    /// -------
    /// AttitudeRun
    ///     `quat_xyzw` (N, 4), `gyro_bias` (N, 3), `status`, `reason`, `at_rest`, `mag_disturbed`.
    fn run(
        &mut self,
        py: Python<'_>,
        gyro_rad_s: &Bound<'_, PyAny>,
        accel_m_s2: &Bound<'_, PyAny>,
        mag_ut: Option<&Bound<'_, PyAny>>,
        stamp_ns: &Bound<'_, PyAny>,
    ) -> PyResult<PyAttitudeRun> {
        let rows = |value, name| floats(value, name, &[None, Some(3)]);
        let gyro = rows(gyro_rad_s, "gyro_rad_s")?;
        let accel = rows(accel_m_s2, "accel_m_s2")?;
        let mag = mag_ut.map(|m| rows(m, "mag_ut")).transpose()?;
        let stamps = stamps(stamp_ns, "stamp_ns")?;
        let (gyro, accel) = (gyro.as_slice()?, accel.as_slice()?);
        let mag = mag.as_ref().map(|m| m.as_slice()).transpose()?;
        let (gyro, accel) = (gyro.as_chunks::<3>().0, accel.as_chunks::<3>().0);
        let mag = mag.map(|m| m.as_chunks::<3>().0);
        py.detach(|| self.0.run(gyro, accel, mag, &stamps))
            .into_python()
            .map(PyAttitudeRun)
    }

    /// The state after the last sample.
    #[getter]
    fn state(&self) -> PyAttitudeState {
        PyAttitudeState(self.0.state())
    }

    fn __repr__(&self) -> String {
        format!("AttitudeFilter({})", self.0.state().status)
    }
}

/// Attitude from a debiased gyro and visual attitudes, continuous and always there: the thesis's
/// (9.2) in its stable form.
///
/// Parameters
/// ----------
/// gain_per_s : float
///     K: an error decays as exp(-K t).
#[pyclass(name = "VisualAttitude", module = "sphereflow.attitude")]
pub struct PyVisualAttitude(VisualAttitude);

#[pymethods]
impl PyVisualAttitude {
    #[new]
    #[pyo3(signature = (gain_per_s = 2.0))]
    fn new(gain_per_s: f64) -> PyResult<Self> {
        VisualAttitude::new(gain_per_s).into_python().map(Self)
    }

    /// One step; returns status and reason.
    #[pyo3(signature = (gyro_rad_s, visual_quat_xyzw = None, *, dt_s))]
    fn step(
        &mut self,
        gyro_rad_s: &Bound<'_, PyAny>,
        visual_quat_xyzw: Option<&Bound<'_, PyAny>>,
        dt_s: f64,
    ) -> PyResult<(&'static str, Option<String>)> {
        let gyro = vector3(gyro_rad_s, "gyro_rad_s")?;
        let visual = visual_quat_xyzw
            .map(|q| rotation_from(q, "visual_quat_xyzw"))
            .transpose()?;
        let status = self.0.step(&gyro, visual.as_ref(), dt_s);
        Ok((status.name(), reason_text(status.reason())))
    }

    /// Attitude, world from body, (4,); None before the first visual one.
    #[getter]
    fn quat_xyzw<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.0
            .rotation()
            .map(|q| PyArray1::from_slice(py, &xyzw(&q)))
    }
}
