//! `PositionObserver`: velocity and position from inertial readings, body velocity and position.

use crate::arguments::{reason_text, rotation_from, vector3};
use crate::arrays::array1;
use crate::errors::IntoPython;
use nalgebra::Vector3;
use numpy::PyArray1;
use pyo3::prelude::*;
use sphereflow_observers::navigation::{PositionGains, PositionObserver};

/// Velocity and position from debiased inertial readings, the attitude, and velocities and positions
/// where they are measured: the thesis's (9.5), with gravity added.
///
/// Parameters
/// ----------
/// velocity_m_s : array_like, (3,)
///     Velocity at the start, body frame.
/// position_m : array_like, (3,)
///     Position at the start, world frame.
/// gravity_m_s2 : array_like, (3,), or None
///     Gravity itself in the world; (0, 9.81, 0) if None: y down.
/// k_v, k_vx, k_x : float
///     Gains: velocity from velocity, 1/s; velocity from position, 1/s^2; position from position, 1/s.
#[pyclass(name = "PositionObserver", module = "sphereflow.navigation")]
pub struct PyPositionObserver(PositionObserver);

#[pymethods]
impl PyPositionObserver {
    #[new]
    #[pyo3(signature = (velocity_m_s, position_m, *, gravity_m_s2 = None, k_v = 4.0, k_vx = 4.0,
        k_x = 4.0))]
    fn new(
        velocity_m_s: &Bound<'_, PyAny>,
        position_m: &Bound<'_, PyAny>,
        gravity_m_s2: Option<&Bound<'_, PyAny>>,
        k_v: f64,
        k_vx: f64,
        k_x: f64,
    ) -> PyResult<Self> {
        let gravity = match gravity_m_s2 {
            Some(gravity) => vector3(gravity, "gravity_m_s2")?,
            None => Vector3::new(0.0, 9.81, 0.0),
        };
        let velocity = vector3(velocity_m_s, "velocity_m_s")?;
        let position = vector3(position_m, "position_m")?;
        let gains = PositionGains { k_v, k_vx, k_x };
        PositionObserver::new(gains, gravity, velocity, position)
            .into_python()
            .map(Self)
    }

    /// One step; returns status and reason.
    ///
    /// Parameters
    /// ----------
    /// gyro_rad_s, accel_m_s2 : array_like, (3,)
    ///     Debiased readings at the end of the step: angular rate, specific force.
    /// world_from_body : array_like, (4,)
    ///     Attitude x, y, z, w at the end of the step.
    /// velocity_m_s, position_m : array_like, (3,), or None
    ///     Measured velocity (body frame) and position (world frame), where there are any.
    /// dt_s : float
    ///     Seconds since the step before.
    #[pyo3(signature = (gyro_rad_s, accel_m_s2, world_from_body, velocity_m_s = None,
        position_m = None, *, dt_s))]
    fn step(
        &mut self,
        gyro_rad_s: &Bound<'_, PyAny>,
        accel_m_s2: &Bound<'_, PyAny>,
        world_from_body: &Bound<'_, PyAny>,
        velocity_m_s: Option<&Bound<'_, PyAny>>,
        position_m: Option<&Bound<'_, PyAny>>,
        dt_s: f64,
    ) -> PyResult<(&'static str, Option<String>)> {
        let gyro = vector3(gyro_rad_s, "gyro_rad_s")?;
        let accel = vector3(accel_m_s2, "accel_m_s2")?;
        let attitude = rotation_from(world_from_body, "world_from_body")?;
        let velocity = velocity_m_s
            .map(|v| vector3(v, "velocity_m_s"))
            .transpose()?;
        let position = position_m.map(|v| vector3(v, "position_m")).transpose()?;
        let status = self.0.step(
            &gyro,
            &accel,
            &attitude,
            velocity.as_ref(),
            position.as_ref(),
            dt_s,
        );
        Ok((status.name(), reason_text(status.reason())))
    }

    /// Velocity, body frame, m/s, (3,).
    #[getter]
    fn velocity_m_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, &self.0.velocity())
    }

    /// Position, world frame, m, (3,).
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, &self.0.position())
    }
}
