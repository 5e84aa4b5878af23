//! `AttitudeFilter` and `VisualAttitude`: attitude from inertial samples and from vision.

use crate::arrays::{floats, stamps};
use crate::errors::{IntoPython, Kind, core_error, exception};
use crate::observers::array1;
use crate::pickle::{Reduced, reduced};
use crate::plain::Plain;
use nalgebra::{UnitQuaternion, Vector3};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyList;
use sphereflow_observers::attitude::{
    AttitudeConfig, AttitudeFilter, AttitudeRun, AttitudeState, Method, VisualAttitude, World,
};
use sphereflow_observers::{Error, Reason, Status};

impl<T> IntoPython<T> for Result<T, Error> {
    fn into_python(self) -> PyResult<T> {
        self.map_err(|error| match error {
            Error::Core(error) => core_error(&error),
        })
    }
}

/// A vector of three from anything like an array.
pub fn vector3(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Vector3<f64>> {
    let array = floats(value, name, &[Some(3)])?;
    Ok(Vector3::from_column_slice(array.as_slice()?))
}

/// The text of a reason, if any.
pub fn reason_text(reason: Option<Reason>) -> Option<String> {
    reason.map(|reason| reason.to_string())
}

/// x, y, z, w.
pub fn xyzw(q: &UnitQuaternion<f64>) -> [f64; 4] {
    [q.i, q.j, q.k, q.w]
}

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
/// method : {'inertial', 'invariant'}
///     The estimator of today's standard, or the invariant observer of the thesis's section 9.4.
/// world : {'enu', 'rdf'}
///     Frame of the answers: x east, y magnetic north, z up; or x east, y down, z north.
/// tau_accel_s, tau_mag_s : float
///     Time constants of the corrections of inclination and heading, seconds.
/// motion_bias, rest_bias, reject_disturbance : bool
///     Estimate the gyro's bias in motion, at rest; leave out a disturbed field.
/// gyro_limit_rad_s : float
///     Largest rate that the gyro can read.
/// max_gap_s : float
///     Longer time steps are gaps.
#[pyclass(name = "AttitudeFilter", module = "sphereflow.attitude")]
pub struct PyAttitudeFilter(AttitudeFilter);

#[pymethods]
impl PyAttitudeFilter {
    #[new]
    #[pyo3(signature = (method = "inertial", *, world = "enu", tau_accel_s = 3.0, tau_mag_s = 9.0,
        motion_bias = true, rest_bias = true, reject_disturbance = true,
        gyro_limit_rad_s = None, max_gap_s = 0.5))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        method: &str,
        world: &str,
        tau_accel_s: f64,
        tau_mag_s: f64,
        motion_bias: bool,
        rest_bias: bool,
        reject_disturbance: bool,
        gyro_limit_rad_s: Option<f64>,
        max_gap_s: f64,
    ) -> PyResult<Self> {
        let defaults = AttitudeConfig::default();
        let config = AttitudeConfig {
            method: method_named(method)?,
            world: world_named(world)?,
            tau_accel_s,
            tau_mag_s,
            motion_bias,
            rest_bias,
            reject_disturbance,
            gyro_limit_rad_s: gyro_limit_rad_s.unwrap_or(defaults.gyro_limit_rad_s),
            max_gap_s,
            ..defaults
        };
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

fn method_named(name: &str) -> PyResult<Method> {
    match name {
        "inertial" => Ok(Method::Inertial),
        "invariant" => Ok(Method::Invariant),
        other => Err(unknown("method", "'inertial' or 'invariant'", other)),
    }
}

fn world_named(name: &str) -> PyResult<World> {
    match name {
        "enu" => Ok(World::EastNorthUp),
        "rdf" => Ok(World::RightDownForward),
        other => Err(unknown("world", "'enu' or 'rdf'", other)),
    }
}

/// The exception for a name that is none of those expected.
pub fn unknown(argument: &str, expected: &str, found: &str) -> PyErr {
    exception(
        Kind::Value,
        format!("{argument}: expected {expected}, found '{found}'"),
    )
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

/// A rotation from x, y, z, w, checked to be of norm 1.
pub fn rotation_from(value: &Bound<'_, PyAny>, name: &str) -> PyResult<UnitQuaternion<f64>> {
    let array = floats(value, name, &[Some(4)])?;
    let found = array.as_slice()?;
    let quat = [found[0], found[1], found[2], found[3]];
    let pose = sphereflow_core::Pose::from_parts([0.0; 3], quat).into_python()?;
    Ok(pose.rotation)
}
