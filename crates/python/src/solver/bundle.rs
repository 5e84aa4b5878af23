//! `BundleProblem`: bundle adjustment.

use super::inertial::{PyImuPreintegration, PyMotion};
use super::measured::{self, Pixels};
use super::result::PySolverResult;
use super::settings::Settings;
use super::{loss, matrices, square, vector3};
use crate::arrays::{indices, vectors3};
use crate::camera::PyCamera;
use crate::errors::{IntoPython, Kind, exception};
use crate::trajectory::pose_from;
use nalgebra::{Matrix3, Matrix6};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use sphereflow_io::problems::{BundleFile, read_bundle};
use sphereflow_sim::problems::{SceneKind, SceneSettings, scene};
use sphereflow_solver::LinearSolver;
use sphereflow_solver::bundle::{BundleAdjuster, BundleProblem};
use std::path::PathBuf;
use std::time::Instant;

/// A bundle adjustment problem: cameras, poses (world from camera), points (world, metres),
/// measurements. Indices are those that the `add_` methods return.
#[pyclass(name = "BundleProblem", module = "sphereflow.solver")]
pub struct PyBundleProblem {
    problem: BundleProblem,
    file: Option<BundleFile>,
}

impl From<BundleProblem> for PyBundleProblem {
    fn from(problem: BundleProblem) -> Self {
        Self {
            problem,
            file: None,
        }
    }
}

#[pymethods]
impl PyBundleProblem {
    #[new]
    fn new() -> Self {
        BundleProblem::new().into()
    }

    /// Read a BAL, Bundler or libmv file; the format is found from the content.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        let mut file = read_bundle(&path).into_python()?;
        Ok(Self {
            problem: std::mem::take(&mut file.problem),
            file: Some(file),
        })
    }

    /// A seeded scene with a known truth; the first two poses are fixed.
    ///
    /// Parameters
    /// ----------
    /// kind : {'room', 'street'}
    /// poses, points, track : int
    ///     Numbers of poses and points, and the most poses that see a point.
    /// depth_sigma_m : float, optional
    ///     Points are measured in the camera frame too, with this noise.
    /// outliers : float
    ///     Share of the pixels that are anywhere.
    /// seed : int
    #[staticmethod]
    #[pyo3(signature = (kind, poses, points, *, track = 8, depth_sigma_m = None, outliers = 0.0,
        seed = 0))]
    fn generate(
        kind: &str,
        poses: usize,
        points: usize,
        track: usize,
        depth_sigma_m: Option<f64>,
        outliers: f64,
        seed: u64,
    ) -> PyResult<Self> {
        let kind = match kind {
            "room" => SceneKind::Room,
            "street" => SceneKind::Street,
            other => {
                let text = format!("kind: expected 'room' or 'street', found '{other}'");
                return Err(exception(Kind::Value, text));
            }
        };
        let settings = SceneSettings {
            track,
            depth_sigma_m,
            outliers,
            ..SceneSettings::new(kind, poses, points, seed)
        };
        Ok(scene(&settings).into_python()?.problem.into())
    }

    /// Write a problem that was read, in its present state: libmv's as libmv's, others as BAL.
    fn write(&self, path: PathBuf) -> PyResult<()> {
        let Some(file) = &self.file else {
            let text = "write: expected a problem that was read from a file, found one made here";
            return Err(exception(Kind::Value, text));
        };
        let mut file = file.clone();
        file.problem = self.problem.clone();
        file.write(&path).into_python()
    }

    /// A camera whose intrinsics are known; poses share it by the index returned.
    fn add_camera(&mut self, camera: &PyCamera) -> usize {
        self.problem.add_camera(camera.0.clone())
    }

    /// Estimate parameters of a camera by name; "focal" is fx and fy together, [] fixes all.
    fn free_intrinsics(&mut self, camera: usize, names: Vec<String>) -> PyResult<()> {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        self.problem.free_intrinsics(camera, &names).into_python()
    }

    /// A pose (4, 4), world from camera; returns its index.
    #[pyo3(signature = (world_from_camera, *, camera = 0, fixed = false))]
    fn add_pose(
        &mut self,
        world_from_camera: &Bound<'_, PyAny>,
        camera: usize,
        fixed: bool,
    ) -> PyResult<usize> {
        let pose = pose_from(world_from_camera, "world_from_camera")?;
        let index = self.problem.add_pose(pose, camera).into_python()?;
        if fixed {
            self.problem.fix_pose(index).into_python()?;
        }
        Ok(index)
    }

    /// Hold a pose where it is.
    fn fix_pose(&mut self, pose: usize) -> PyResult<()> {
        self.problem.fix_pose(pose).into_python()
    }

    /// Points (N, 3), world, metres; returns the index of the first.
    fn add_points(&mut self, points_m: &Bound<'_, PyAny>) -> PyResult<usize> {
        let first = self.problem.points();
        for point in vectors3(points_m, "points_m")? {
            self.problem.add_point(point).into_python()?;
        }
        Ok(first)
    }

    /// Pixels (N, 2) at which poses (N,) see points (N,), with one standard deviation.
    #[pyo3(signature = (pose, point, pixel, *, sigma_px = 1.0))]
    fn add_pixels(
        &mut self,
        pose: &Bound<'_, PyAny>,
        point: &Bound<'_, PyAny>,
        pixel: &Bound<'_, PyAny>,
        sigma_px: f64,
    ) -> PyResult<()> {
        measured::add_pixels(&mut self.problem, (pose, point), pixel, sigma_px)
    }

    /// Points (N, 3) as poses (N,) measure them in the camera frame, metres (thesis 9.1).
    #[pyo3(signature = (pose, point, point_in_camera_m, *, sigma_m))]
    fn add_point_measurements(
        &mut self,
        pose: &Bound<'_, PyAny>,
        point: &Bound<'_, PyAny>,
        point_in_camera_m: &Bound<'_, PyAny>,
        sigma_m: f64,
    ) -> PyResult<()> {
        measured::add_points(&mut self.problem, (pose, point), point_in_camera_m, sigma_m)
    }

    /// Inverse distances (N,) along the ray from poses (N,) to points (N,), per metre.
    #[pyo3(signature = (pose, point, inv_range, *, sigma))]
    fn add_inverse_ranges(
        &mut self,
        pose: &Bound<'_, PyAny>,
        point: &Bound<'_, PyAny>,
        inv_range: &Bound<'_, PyAny>,
        sigma: f64,
    ) -> PyResult<()> {
        measured::add_inverse_ranges(&mut self.problem, (pose, point), inv_range, sigma)
    }

    /// What is known of a pose's rotation (its (4, 4) world from camera); covariance (3, 3) of the
    /// rotation vector in the camera frame.
    fn add_attitude_prior(
        &mut self,
        pose: usize,
        world_from_camera: &Bound<'_, PyAny>,
        covariance: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let known = pose_from(world_from_camera, "world_from_camera")?.rotation;
        let covariance: Matrix3<f64> = square(covariance, "covariance")?;
        self.problem
            .add_attitude_prior(pose, &known, &covariance)
            .into_python()
    }

    /// What is known of a pose; covariance (6, 6) of [omega, v] in the camera frame.
    fn add_pose_prior(
        &mut self,
        pose: usize,
        world_from_camera: &Bound<'_, PyAny>,
        covariance: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let known = pose_from(world_from_camera, "world_from_camera")?;
        let covariance: Matrix6<f64> = square(covariance, "covariance")?;
        self.problem
            .add_pose_prior(pose, &known, &covariance)
            .into_python()
    }

    /// Gravity in the world (3,), m/s^2, pointing down, and where the camera is in the IMU's frame
    /// (4, 4): before the first motion.
    fn set_imu(
        &mut self,
        gravity_m_s2: &Bound<'_, PyAny>,
        body_from_camera: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let gravity = vector3(gravity_m_s2, "gravity_m_s2")?;
        let body_from_camera = pose_from(body_from_camera, "body_from_camera")?;
        self.problem
            .set_imu(gravity, body_from_camera)
            .into_python()
    }

    /// Estimate velocity and biases at a pose too, from `motion` on (zeros where None).
    #[pyo3(signature = (pose, motion = None))]
    fn add_motion(&mut self, pose: usize, motion: Option<&PyMotion>) -> PyResult<()> {
        let motion = motion.map(|motion| motion.0).unwrap_or_default();
        self.problem.add_motion(pose, motion).into_python()
    }

    /// Tie two poses that have motions by the IMU samples between them.
    fn add_imu(
        &mut self,
        first: usize,
        second: usize,
        samples: &PyImuPreintegration,
    ) -> PyResult<()> {
        let added = self.problem.add_imu(first, second, samples.0.clone());
        added.into_python()
    }

    /// Biases of `motion` known at a pose that has one, with a standard deviation for each sensor
    /// (rad/s, m/s^2); its velocity does not count.
    #[pyo3(signature = (pose, motion, *, gyro_sigma, accel_sigma))]
    fn add_bias_prior(
        &mut self,
        pose: usize,
        motion: &PyMotion,
        gyro_sigma: f64,
        accel_sigma: f64,
    ) -> PyResult<()> {
        let sigmas = (gyro_sigma, accel_sigma);
        self.problem
            .add_bias_prior(pose, motion.0.bias, sigmas)
            .into_python()
    }

    /// Velocity and biases at a pose; None where they are not estimated.
    fn motion(&self, pose: usize) -> Option<PyMotion> {
        self.problem.motion(pose).map(PyMotion)
    }

    /// Marginalise poses out with their motions, the points they see and the samples that tie them:
    /// what those say of the others stays as a Gaussian prior around the present state.
    fn marginalise(&mut self, poses: &Bound<'_, PyAny>) -> PyResult<()> {
        self.problem
            .marginalise(&indices(poses, "poses")?)
            .into_python()
    }

    /// The loss of all measurements: 'quadratic', 'huber', 'cauchy' or 'tukey', with its threshold
    /// in standard deviations.
    #[pyo3(signature = (name, threshold = 1.0))]
    fn set_loss(&mut self, name: &str, threshold: f64) -> PyResult<()> {
        let loss = loss(name, threshold)?;
        let losses = &mut self.problem.losses;
        (losses.pixel, losses.point, losses.inverse_range) = (loss, loss, loss);
        Ok(())
    }

    /// Adjust from the present state on, in place; Ctrl-C ends it after the iteration under way.
    #[pyo3(signature = (*, max_iterations = 50, function_tolerance = 1e-6,
        parameter_tolerance = 1e-8, time_budget_s = None, threads = 0))]
    fn solve(
        &mut self,
        py: Python<'_>,
        max_iterations: usize,
        function_tolerance: f64,
        parameter_tolerance: f64,
        time_budget_s: Option<f64>,
        threads: usize,
    ) -> PyResult<PySolverResult> {
        let tolerances = [function_tolerance, parameter_tolerance];
        let settings = Settings::new(max_iterations, tolerances, time_budget_s, threads)?;
        let problem = &mut self.problem;
        let work = || {
            let begin = Instant::now();
            let mut adjuster = BundleAdjuster::new(std::mem::take(problem), LinearSolver::Auto);
            let setup = begin.elapsed();
            let summary = adjuster.solve(&settings.options);
            *problem = adjuster.into_problem();
            (setup, summary)
        };
        let (setup, summary) = settings.run(py, work)?;
        let summary = summary.into_python()?;
        Ok(PySolverResult {
            issues: summary.issues.iter().map(ToString::to_string).collect(),
            linear_solver: Some(summary.linear_solver),
            rejected: Vec::new(),
            setup,
            summary: summary.summary,
        })
    }

    /// Joint covariance (6 K, 6 K) of K poses at the present state: [omega, v] in each camera frame.
    fn covariance<'py>(
        &self,
        py: Python<'py>,
        poses: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let poses = indices(poses, "poses")?;
        let mut adjuster = BundleAdjuster::new(self.problem.clone(), LinearSolver::Auto);
        let matrix = py.detach(|| adjuster.covariance(&poses)).into_python()?;
        let size = matrix.nrows();
        PyArray1::from_slice(py, matrix.as_slice()).reshape([size, size])
    }

    /// Poses (N, 4, 4), world from camera.
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        matrices(
            py,
            (0..self.problem.poses()).filter_map(|k| self.problem.pose(k)),
        )
    }

    /// Points (N, 3), world, metres.
    #[getter]
    fn points_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let count = self.problem.points();
        let points = (0..count).filter_map(|k| self.problem.point(k));
        let values: Vec<f64> = points.flat_map(|p| [p.x, p.y, p.z]).collect();
        PyArray1::from_vec(py, values).reshape([count, 3])
    }

    /// Measured pixels: poses (N,), points (N,), pixels (N, 2).
    #[getter]
    fn pixels<'py>(&self, py: Python<'py>) -> PyResult<Pixels<'py>> {
        measured::pixels(py, &self.problem)
    }

    /// The camera of a pose, with its intrinsics as they are now.
    fn camera_of_pose(&self, pose: usize) -> PyResult<PyCamera> {
        let camera = self.problem.camera_of_pose(pose);
        let camera = camera.and_then(|camera| self.problem.camera(camera));
        let text = || {
            format!(
                "pose: expected an index below {}, found {pose}",
                self.problem.poses()
            )
        };
        camera
            .map(|camera| PyCamera(camera.clone()))
            .ok_or_else(|| exception(Kind::Value, text()))
    }

    /// Number of measurements.
    #[getter]
    fn measurements(&self) -> usize {
        self.problem.observations()
    }

    fn __repr__(&self) -> String {
        format!(
            "BundleProblem({} poses, {} points, {} measurements)",
            self.problem.poses(),
            self.problem.points(),
            self.problem.observations()
        )
    }
}
