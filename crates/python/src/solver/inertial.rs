//! `ImuPreintegration`, `Motion` and `InertialWindow`: the IMU in bundle adjustment, and alone.

use super::result::PySolverResult;
use super::settings::Settings;
use super::{matrices, square, vector3};
use crate::arrays::{array1, floats, vectors3};
use crate::errors::{IntoPython, Kind, exception};
use crate::plain::Plain;
use crate::reduce::{Reduced, reduced};
use crate::trajectory::pose_from;
use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use sphereflow_solver::bundle::Motion;
use sphereflow_solver::inertial::{
    ImuBias, ImuSigmas, InertialState, InertialWindow, Preintegration,
};
use std::time::Instant;

/// A vector of three, zeros where there is none.
fn or_zeros(value: Option<&Bound<'_, PyAny>>, name: &str) -> PyResult<Vector3<f64>> {
    value.map_or(Ok(Vector3::zeros()), |value| vector3(value, name))
}

/// What the IMU adds to a pose: velocity of the body in the world and biases, each (3,).
///
/// Parameters
/// ----------
/// velocity_m_s, gyro_bias_rad_s, accel_bias_m_s2 : (3,) array, optional
///     Zeros where absent. A bias is subtracted from what is measured.
#[pyclass(name = "Motion", module = "sphereflow.solver", frozen)]
pub struct PyMotion(pub Motion);

#[pymethods]
impl PyMotion {
    #[new]
    #[pyo3(signature = (*, velocity_m_s = None, gyro_bias_rad_s = None, accel_bias_m_s2 = None))]
    fn new(
        velocity_m_s: Option<&Bound<'_, PyAny>>,
        gyro_bias_rad_s: Option<&Bound<'_, PyAny>>,
        accel_bias_m_s2: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        Ok(Self(Motion {
            velocity: or_zeros(velocity_m_s, "velocity_m_s")?,
            bias: ImuBias {
                gyro: or_zeros(gyro_bias_rad_s, "gyro_bias_rad_s")?,
                accel: or_zeros(accel_bias_m_s2, "accel_bias_m_s2")?,
            },
        }))
    }

    /// Velocity of the body in the world, m/s.
    #[getter]
    fn velocity_m_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, &self.0.velocity)
    }

    /// Bias of the angular rate, rad/s.
    #[getter]
    fn gyro_bias_rad_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, &self.0.bias.gyro)
    }

    /// Bias of the specific force, m/s^2.
    #[getter]
    fn accel_bias_m_s2<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, &self.0.bias.accel)
    }

    fn __repr__(&self) -> String {
        let Motion { velocity, bias } = &self.0;
        format!(
            "Motion(velocity_m_s={:?}, gyro_bias_rad_s={:?}, accel_bias_m_s2={:?})",
            velocity.as_slice(),
            bias.gyro.as_slice(),
            bias.accel.as_slice()
        )
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        reduced(py, "Motion", self.0.to_plain(py)?)
    }
}

/// IMU samples between two instants as one relative measurement, which biases move to first order
/// (Forster et al., 2017).
///
/// Parameters
/// ----------
/// gyro_sigma, accel_sigma : float
///     Noise densities, rad/s/sqrt(Hz) and m/s^2/sqrt(Hz).
/// gyro_walk, accel_walk : float
///     Walks of the biases, rad/s^2/sqrt(Hz) and m/s^3/sqrt(Hz).
/// around : Motion, optional
///     The biases that are subtracted from the samples; zeros where absent.
#[pyclass(name = "ImuPreintegration", module = "sphereflow.solver")]
pub struct PyImuPreintegration(pub Preintegration);

#[pymethods]
impl PyImuPreintegration {
    #[new]
    #[pyo3(signature = (*, gyro_sigma, accel_sigma, gyro_walk, accel_walk, around = None))]
    fn new(
        gyro_sigma: f64,
        accel_sigma: f64,
        gyro_walk: f64,
        accel_walk: f64,
        around: Option<&PyMotion>,
    ) -> PyResult<Self> {
        let sigmas = ImuSigmas {
            gyro: gyro_sigma,
            accel: accel_sigma,
            gyro_walk,
            accel_walk,
        };
        let bias = around.map(|motion| motion.0.bias).unwrap_or_default();
        Ok(Self(Preintegration::new(bias, sigmas).into_python()?))
    }

    /// Add samples (N, 3), rad/s and m/s^2 (specific force), each of which holds for `dt_s` seconds:
    /// a number, or one for each (N,).
    fn push(
        &mut self,
        gyro_rad_s: &Bound<'_, PyAny>,
        accel_m_s2: &Bound<'_, PyAny>,
        dt_s: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let gyro = vectors3(gyro_rad_s, "gyro_rad_s")?;
        let accel = vectors3(accel_m_s2, "accel_m_s2")?;
        let dt = match dt_s.extract::<f64>() {
            Ok(one) => vec![one; gyro.len()],
            Err(_) => floats(dt_s, "dt_s", &[Some(gyro.len())])?
                .as_slice()?
                .to_vec(),
        };
        if gyro.len() != accel.len() || gyro.len() != dt.len() {
            let (gyro, accel) = (gyro.len(), accel.len());
            let text =
                format!("gyro_rad_s, accel_m_s2: expected one length, found {gyro} and {accel}");
            return Err(exception(Kind::Shape, text));
        }
        // all of them, or none
        let mut all = self.0.clone();
        for ((gyro, accel), dt) in gyro.iter().zip(&accel).zip(dt) {
            all.push(gyro, accel, dt).into_python()?;
        }
        self.0 = all;
        Ok(())
    }

    /// Seconds integrated.
    #[getter]
    fn seconds(&self) -> f64 {
        self.0.seconds()
    }

    /// Rotation (3, 3), velocity (3,) and position (3,) changes in the first body frame, without
    /// gravity, with the biases of `motion` (those they were integrated around where None).
    #[pyo3(signature = (motion = None))]
    #[allow(clippy::type_complexity)]
    fn change<'py>(
        &self,
        py: Python<'py>,
        motion: Option<&PyMotion>,
    ) -> PyResult<(
        Bound<'py, PyArray2<f64>>,
        Bound<'py, PyArray1<f64>>,
        Bound<'py, PyArray1<f64>>,
    )> {
        let bias = motion.map_or(self.0.bias, |motion| motion.0.bias);
        let (rotation, velocity, position) = self.0.corrected(&bias);
        let rotation = rotation.to_rotation_matrix().into_inner().transpose();
        Ok((
            PyArray1::from_slice(py, rotation.as_slice()).reshape([3, 3])?,
            array1(py, &velocity),
            array1(py, &position),
        ))
    }

    fn __repr__(&self) -> String {
        format!("ImuPreintegration({} s)", self.0.seconds())
    }
}

/// Poses, velocities and biases tied by IMU samples, with measured poses (a pose graph's, or bundle
/// adjustment's with their covariances).
///
/// Parameters
/// ----------
/// world_from_body : (4, 4) array
///     The first pose; the body is the IMU.
/// gravity_m_s2 : (3,) array
///     In the world, pointing down.
/// motion : Motion, optional
///     Velocity and biases of the first state; zeros where absent.
#[pyclass(name = "InertialWindow", module = "sphereflow.solver")]
pub struct PyInertialWindow(InertialWindow);

#[pymethods]
impl PyInertialWindow {
    #[new]
    #[pyo3(signature = (world_from_body, gravity_m_s2, motion = None))]
    fn new(
        world_from_body: &Bound<'_, PyAny>,
        gravity_m_s2: &Bound<'_, PyAny>,
        motion: Option<&PyMotion>,
    ) -> PyResult<Self> {
        let motion = motion.map(|motion| motion.0).unwrap_or_default();
        let first = InertialState {
            pose: pose_from(world_from_body, "world_from_body")?,
            velocity: motion.velocity,
            bias: motion.bias,
        };
        let gravity = vector3(gravity_m_s2, "gravity_m_s2")?;
        Ok(Self(InertialWindow::new(first, gravity).into_python()?))
    }

    /// The next state, where the samples since the last one lead; returns its index.
    fn push(&mut self, since_last: &PyImuPreintegration) -> PyResult<usize> {
        self.0.push(since_last.0.clone()).into_python()
    }

    /// A measured pose (4, 4) of a state, world from body; covariance (6, 6) of [omega, v] in the
    /// body frame.
    fn add_pose(
        &mut self,
        state: usize,
        world_from_body: &Bound<'_, PyAny>,
        covariance: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let pose = pose_from(world_from_body, "world_from_body")?;
        let covariance = square(covariance, "covariance")?;
        self.0.add_pose(state, pose, &covariance).into_python()
    }

    /// Known biases of a state, those of `motion`, with a standard deviation for each sensor.
    #[pyo3(signature = (state, motion, *, gyro_sigma, accel_sigma))]
    fn add_bias_prior(
        &mut self,
        state: usize,
        motion: &PyMotion,
        gyro_sigma: f64,
        accel_sigma: f64,
    ) -> PyResult<()> {
        let sigmas = (gyro_sigma, accel_sigma);
        self.0.add_bias(state, motion.0.bias, sigmas).into_python()
    }

    /// Minimise from the present states on, in place; Ctrl-C ends it after the iteration under way.
    #[pyo3(signature = (*, max_iterations = 50, function_tolerance = 1e-6,
        parameter_tolerance = 1e-8, time_budget_s = None))]
    fn solve(
        &mut self,
        py: Python<'_>,
        max_iterations: usize,
        function_tolerance: f64,
        parameter_tolerance: f64,
        time_budget_s: Option<f64>,
    ) -> PyResult<PySolverResult> {
        let tolerances = [function_tolerance, parameter_tolerance];
        let settings = Settings::new(max_iterations, tolerances, time_budget_s, 1)?;
        let (window, begin) = (&mut self.0, Instant::now());
        let summary = settings.run(py, || window.solve(&settings.options))?;
        let summary = summary.into_python()?;
        Ok(PySolverResult {
            issues: Vec::new(),
            linear_solver: None,
            rejected: Vec::new(),
            setup: begin.elapsed().saturating_sub(summary.elapsed),
            summary,
        })
    }

    /// Poses (N, 4, 4), world from body.
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        matrices(py, self.0.states().iter().map(|state| state.pose))
    }

    /// Velocities and biases of the states.
    #[getter]
    fn motions(&self) -> Vec<PyMotion> {
        let motion = |state: &InertialState| {
            PyMotion(Motion {
                velocity: state.velocity,
                bias: state.bias,
            })
        };
        self.0.states().iter().map(motion).collect()
    }

    fn __repr__(&self) -> String {
        format!("InertialWindow({} states)", self.0.states().len())
    }
}
