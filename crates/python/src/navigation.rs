//! `NavigationFilter`: pose, velocity and biases from whatever comes.

use crate::arguments::{covariance3, reason_text, vector3};
use crate::arrays::{array1, floats, square, xyzw};
use crate::config::{keywords, settings};
use crate::errors::IntoPython;
use crate::plain::Plain;
use crate::plain::reason_values;
use crate::reduce::{Reduced, reduced};
use crate::trajectory::pose_from;
use nalgebra::{Matrix6, Vector6};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sphereflow_core::ReasonCode;
use sphereflow_core::{ImuSample, Stamp};
use sphereflow_observers::Status;
use sphereflow_observers::navigation::{NavigationConfig, NavigationFilter, NavigationState};

/// Status and reason of a push.
type Outcome = (&'static str, Option<String>);

fn outcome(status: Status) -> Outcome {
    (status.name(), reason_text(status.reason()))
}

/// What the filter says of an instant.
#[pyclass(name = "NavigationState", module = "sphereflow.navigation", frozen)]
pub struct PyNavigationState(pub NavigationState);

#[pymethods]
impl PyNavigationState {
    /// When.
    #[getter]
    fn stamp_ns(&self) -> i64 {
        self.0.stamp.ns()
    }

    /// Position of the body in the world, m, (3,).
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, &self.0.nominal.world_from_body.translation)
    }

    /// Attitude, world from body, (4,).
    #[getter]
    fn quat_xyzw<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &xyzw(&self.0.nominal.world_from_body.rotation))
    }

    /// World from body, (4, 4).
    #[getter]
    fn world_from_body<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let matrix = self.0.nominal.world_from_body.matrix().transpose();
        square(py, matrix.as_slice(), 4)
    }

    /// Velocity, world frame, m/s, (3,).
    #[getter]
    fn velocity_m_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, &self.0.nominal.velocity_m_s)
    }

    /// To be subtracted from the gyro, rad/s, (3,).
    #[getter]
    fn gyro_bias<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, &self.0.nominal.gyro_bias_rad_s)
    }

    /// To be subtracted from the accelerometer, m/s^2, (3,).
    #[getter]
    fn accel_bias<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, &self.0.nominal.accel_bias_m_s2)
    }

    /// Covariance [theta, velocity, position, gyro bias, accelerometer bias], (15, 15); world frame
    /// but for the biases, `R_true = exp(theta) R`.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        square(py, self.0.covariance.as_slice(), 15)
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
        format!("NavigationState({})", self.0.status)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        reduced(py, "NavigationState", self.0.to_plain(py)?)
    }
}

/// Position, velocity, attitude and IMU biases from inertial readings, magnetic fields, velocities
/// and poses, in any order within the delay. There is always an answer after the first reading.
///
/// Parameters
/// ----------
/// config : sphereflow.config.NavigationConfig, optional
///     All settings. The keywords that follow, where given, replace what it says.
/// gravity_m_s2 : array_like, (3,), or None
///     Gravity itself in the world; (0, 9.81, 0) if None: y down.
/// body_from_camera : array_like, (4, 4), or None
///     Where the camera sits on the IMU.
/// gyro_sigma_rad_s, accel_sigma_m_s2 : float, optional
///     Standard deviations of one reading.
/// gyro_walk, accel_walk : float, optional
///     How the biases wander, rad/s/sqrt(s), m/s^2/sqrt(s).
/// max_delay_s : float, optional
///     So late may a sample come.
#[pyclass(name = "NavigationFilter", module = "sphereflow.navigation")]
pub struct PyNavigationFilter(NavigationFilter);

#[pymethods]
impl PyNavigationFilter {
    #[new]
    #[pyo3(signature = (*, config = None, gravity_m_s2 = None, body_from_camera = None,
        gyro_sigma_rad_s = None, accel_sigma_m_s2 = None, gyro_walk = None, accel_walk = None,
        max_delay_s = None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        config: Option<&Bound<'_, PyAny>>,
        gravity_m_s2: Option<&Bound<'_, PyAny>>,
        body_from_camera: Option<&Bound<'_, PyAny>>,
        gyro_sigma_rad_s: Option<f64>,
        accel_sigma_m_s2: Option<f64>,
        gyro_walk: Option<f64>,
        accel_walk: Option<f64>,
        max_delay_s: Option<f64>,
    ) -> PyResult<Self> {
        let mut config: NavigationConfig = settings(config)?;
        let gravity = gravity_m_s2.map(|g| vector3(g, "gravity_m_s2"));
        let camera = body_from_camera.map(|p| pose_from(p, "body_from_camera"));
        keywords!(config {
            gravity_m_s2 = gravity.transpose()?,
            body_from_camera = camera.transpose()?,
            gyro_sigma_rad_s = gyro_sigma_rad_s,
            accel_sigma_m_s2 = accel_sigma_m_s2,
            gyro_walk = gyro_walk,
            accel_walk = accel_walk,
            max_delay_s = max_delay_s,
        });
        NavigationFilter::new(config).into_python().map(Self)
    }

    /// A gyro and accelerometer reading, body frame; returns status and reason.
    fn push_imu(
        &mut self,
        stamp_ns: i64,
        gyro_rad_s: &Bound<'_, PyAny>,
        accel_m_s2: &Bound<'_, PyAny>,
    ) -> PyResult<Outcome> {
        let sample = ImuSample {
            stamp: Stamp::from_ns(stamp_ns),
            gyro_rad_s: vector3(gyro_rad_s, "gyro_rad_s")?,
            accel_m_s2: vector3(accel_m_s2, "accel_m_s2")?,
        };
        Ok(outcome(self.0.push_imu(&sample)))
    }

    /// A magnetic field, body frame, any unit; returns status and reason.
    fn push_mag(&mut self, stamp_ns: i64, mag_ut: &Bound<'_, PyAny>) -> PyResult<Outcome> {
        let mag = vector3(mag_ut, "mag_ut")?;
        Ok(outcome(self.0.push_mag(Stamp::from_ns(stamp_ns), &mag)))
    }

    /// A velocity of the camera, camera frame, m/s, with its (3, 3) covariance or one standard
    /// deviation; returns status and reason.
    fn push_velocity(
        &mut self,
        stamp_ns: i64,
        velocity_m_s: &Bound<'_, PyAny>,
        covariance: &Bound<'_, PyAny>,
    ) -> PyResult<Outcome> {
        let velocity = vector3(velocity_m_s, "velocity_m_s")?;
        let covariance = covariance3(covariance, "covariance")?;
        let stamp = Stamp::from_ns(stamp_ns);
        Ok(outcome(self.0.push_velocity(stamp, &velocity, &covariance)))
    }

    /// A pose of the camera, `world_from_camera` (4, 4), with its (6, 6) covariance [rotation,
    /// position] in the world frame, or the pair (sigma_rad, sigma_m); returns status and reason.
    fn push_pose(
        &mut self,
        stamp_ns: i64,
        world_from_camera: &Bound<'_, PyAny>,
        covariance: &Bound<'_, PyAny>,
    ) -> PyResult<Outcome> {
        let pose = pose_from(world_from_camera, "world_from_camera")?;
        let covariance = match covariance.extract::<(f64, f64)>() {
            Ok((rad, m)) => {
                let (r, p) = (rad * rad, m * m);
                Matrix6::from_diagonal(&Vector6::new(r, r, r, p, p, p))
            }
            Err(_) => {
                let array = floats(covariance, "covariance", &[Some(6), Some(6)])?;
                Matrix6::from_row_slice(array.as_slice()?)
            }
        };
        let stamp = Stamp::from_ns(stamp_ns);
        Ok(outcome(self.0.push_pose(stamp, &pose, &covariance)))
    }

    /// The assurance that nothing moves; returns status and reason.
    #[pyo3(signature = (stamp_ns, sigma_m_s = 0.01))]
    fn push_zero_velocity(&mut self, stamp_ns: i64, sigma_m_s: f64) -> Outcome {
        outcome(
            self.0
                .push_zero_velocity(Stamp::from_ns(stamp_ns), sigma_m_s),
        )
    }

    /// The state at a stamp; None before the first inertial reading.
    fn state(&self, stamp_ns: i64) -> Option<PyNavigationState> {
        self.0
            .state(Stamp::from_ns(stamp_ns))
            .map(PyNavigationState)
    }
}
