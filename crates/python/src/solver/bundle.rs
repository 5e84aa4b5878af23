//! `BundleProblem`: bundle adjustment.

use super::result::PySolverResult;
use super::settings::Settings;
use super::{loss, matrices, square};
use crate::arrays::{floats, indices, vectors3};
use crate::camera::PyCamera;
use crate::errors::{IntoPython, Kind, exception};
use crate::trajectory::pose_from;
use nalgebra::{Matrix2, Matrix3, Matrix6, Vector2};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use sphereflow_io::problems::{BundleFile, read_bundle};
use sphereflow_solver::LinearSolver;
use sphereflow_solver::bundle::{BundleAdjuster, BundleProblem};
use sphereflow_solver::generate::{SceneKind, SceneSettings, scene};
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
        let (pose, point) = (indices(pose, "pose")?, indices(point, "point")?);
        let pixel = floats(pixel, "pixel", &[Some(pose.len()), Some(2)])?;
        same_length(&pose, &point)?;
        let covariance = Matrix2::identity() * sigma_px * sigma_px;
        for (k, uv) in pixel.as_slice()?.chunks_exact(2).enumerate() {
            let uv = Vector2::new(uv[0], uv[1]);
            let added = self.problem.add_pixel(pose[k], point[k], uv, &covariance);
            added.into_python()?;
        }
        Ok(())
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
        let (pose, point) = (indices(pose, "pose")?, indices(point, "point")?);
        same_length(&pose, &point)?;
        let measured = vectors3(point_in_camera_m, "point_in_camera_m")?;
        same_length(&pose, &measured)?;
        let covariance = Matrix3::identity() * sigma_m * sigma_m;
        for (k, x) in measured.into_iter().enumerate() {
            let added = self
                .problem
                .add_point_measurement(pose[k], point[k], x, &covariance);
            added.into_python()?;
        }
        Ok(())
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
        let (pose, point) = (indices(pose, "pose")?, indices(point, "point")?);
        same_length(&pose, &point)?;
        let measured = floats(inv_range, "inv_range", &[Some(pose.len())])?;
        for (k, value) in measured.as_slice()?.iter().enumerate() {
            self.problem
                .add_inverse_range(pose[k], point[k], *value, sigma)
                .into_python()?;
        }
        Ok(())
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
        let settings = Settings::new(
            max_iterations,
            function_tolerance,
            parameter_tolerance,
            time_budget_s,
            threads,
        )?;
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
    #[allow(clippy::type_complexity)]
    fn pixels<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(
        Bound<'py, PyArray1<i64>>,
        Bound<'py, PyArray1<i64>>,
        Bound<'py, PyArray2<f64>>,
    )> {
        let (mut poses, mut points, mut values) = (Vec::new(), Vec::new(), Vec::new());
        for (pose, point, pixel) in self.problem.pixels() {
            poses.push(pose as i64);
            points.push(point as i64);
            values.extend(pixel.iter());
        }
        let count = poses.len();
        Ok((
            PyArray1::from_vec(py, poses),
            PyArray1::from_vec(py, points),
            PyArray1::from_vec(py, values).reshape([count, 2])?,
        ))
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

fn same_length<A, B>(first: &[A], second: &[B]) -> PyResult<()> {
    if first.len() == second.len() {
        return Ok(());
    }
    let (first, second) = (first.len(), second.len());
    let text = format!("pose, point, measurement: expected one length, found {first} and {second}");
    Err(exception(Kind::Shape, text))
}
