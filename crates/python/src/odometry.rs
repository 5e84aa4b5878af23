//! `DepthOdometry`: poses of a moving depth camera.

use crate::camera::PyCamera;
use crate::errors::{IntoPython, Kind, core_error, exception};
use crate::trajectory::pose_matrix;
use crate::velocity::{Image, config, matrix6, reason, vector3};
use nalgebra::{Matrix6, Vector3};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sphereflow_core::{Stamp, Twist};
use sphereflow_odometry::{DepthOdometry, Error, OdometryConfig, OdometryResult};

impl<T> IntoPython<T> for Result<T, Error> {
    fn into_python(self) -> PyResult<T> {
        self.map_err(|error| match error {
            Error::Core(error) => core_error(&error),
        })
    }
}

/// What became of one frame.
#[pyclass(name = "OdometryResult", module = "sphereflow.odometry", frozen)]
pub struct PyOdometryResult(pub OdometryResult);

impl PyOdometryResult {
    fn part(&self, take: impl Fn(&Twist) -> Vector3<f64>) -> Vector3<f64> {
        self.0
            .twist
            .as_ref()
            .map_or(Vector3::repeat(f64::NAN), take)
    }
}

#[pymethods]
impl PyOdometryResult {
    /// The frame's stamp, nanoseconds.
    #[getter]
    fn stamp_ns(&self) -> i64 {
        self.0.stamp.ns()
    }

    /// "started", "tracked", "weak", "lost" or "skipped".
    #[getter]
    fn status(&self) -> &'static str {
        self.0.status.name()
    }

    /// Why, where it is neither "started" nor "tracked".
    #[getter]
    fn reason(&self) -> Option<String> {
        reason(&self.0.status)
    }

    /// True where the pose was measured or defined; False where it is only predicted.
    #[getter]
    fn has_pose(&self) -> bool {
        self.0.status.has_pose()
    }

    /// Pose of the camera in the frame of the first one, (4, 4).
    #[getter]
    fn world_from_camera<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        pose_matrix(py, &self.0.world_from_camera)
    }

    /// Position of the camera in the world, metres, (3,).
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector3(py, &self.0.world_from_camera.translation)
    }

    /// Rotation, world from camera, x, y, z, w, (4,).
    #[getter]
    fn quat_xyzw<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.0.world_from_camera.quat_xyzw())
    }

    /// Measured linear velocity, m/s, body frame, (3,); NaN where not measured.
    #[getter]
    fn linear_m_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector3(py, &self.part(|t| t.linear_m_s))
    }

    /// Measured angular velocity, rad/s, body frame, (3,); NaN where not measured.
    #[getter]
    fn angular_rad_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector3(py, &self.part(|t| t.angular_rad_s))
    }

    /// Covariance of the velocities, order [omega, v], (6, 6); NaN where not measured.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix6(py, &self.0.covariance.unwrap_or(Matrix6::repeat(f64::NAN)))
    }

    /// 0 (some motion changes nothing) to 1 (Theorem 3); NaN where not measured.
    #[getter]
    fn score(&self) -> f64 {
        self.0
            .estimate
            .as_ref()
            .map_or(f64::NAN, |estimate| estimate.score)
    }

    /// Grows by one where the chain of measurements breaks.
    #[getter]
    fn segment(&self) -> u32 {
        self.0.segment
    }

    /// Milliseconds spent, by stage.
    #[getter]
    fn timings_ms<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("averaging", 1e3 * self.0.timings.averaging_s)?;
        dict.set_item("estimation", 1e3 * self.0.timings.estimation_s)?;
        Ok(dict)
    }

    fn __repr__(&self) -> String {
        let p = self.0.world_from_camera.translation;
        format!(
            "OdometryResult({} s, {}, position_m=[{:.4}, {:.4}, {:.4}])",
            self.0.stamp, self.0.status, p.x, p.y, p.z
        )
    }
}

/// Poses of a moving depth camera, one frame at a time.
///
/// The world is the camera frame of the first frame. Each frame is measured against the one before;
/// drift grows with time. Results are the same for any number of threads.
///
/// Parameters
/// ----------
/// camera : Camera
///     The depth camera, any model.
/// method, along, warps, domains
///     As in `estimate_velocity`.
#[pyclass(name = "DepthOdometry", module = "sphereflow.odometry")]
pub struct PyDepthOdometry {
    odometry: DepthOdometry,
    camera: PyCamera,
    along: String,
}

#[pymethods]
impl PyDepthOdometry {
    #[new]
    #[pyo3(signature = (camera, *, method = "single", along = "axis", warps = None, domains = None))]
    fn new(
        camera: &PyCamera,
        method: &str,
        along: &str,
        warps: Option<usize>,
        domains: Option<usize>,
    ) -> PyResult<Self> {
        let config = OdometryConfig {
            alignment: config(method, warps, domains)?,
            ..OdometryConfig::default()
        };
        if !matches!(along, "axis" | "ray") {
            let text = format!("along: expected 'axis' (depth) or 'ray' (range), found '{along}'");
            return Err(exception(Kind::Value, text));
        }
        Ok(Self {
            odometry: DepthOdometry::new(&camera.0, config).into_python()?,
            camera: camera.clone(),
            along: along.into(),
        })
    }

    /// The camera.
    #[getter]
    fn camera(&self) -> PyCamera {
        self.camera.clone()
    }

    /// The next frame.
    ///
    /// Parameters
    /// ----------
    /// depth_m : array_like of float, (H, W), or None
    ///     Metres, NaN or zero unknown; None where the frame has no depth image.
    /// stamp_ns : int
    ///     Nanoseconds. A stamp that does not increase is skipped, with a reason.
    ///
    /// Returns
    /// -------
    /// OdometryResult
    ///     `status` is 'started', 'tracked', 'weak', 'lost' or 'skipped', `reason` says why, and only where
    ///     `has_pose` is true was the pose measured (a repeated image has that of the image it
    ///     repeats); a lost frame's pose is predicted.
    ///
    /// Raises
    /// ------
    /// ShapeError, DtypeError
    ///     Naming `depth_m`; the odometry is as before.
    fn push(
        &mut self,
        py: Python<'_>,
        depth_m: Option<&Bound<'_, PyAny>>,
        stamp_ns: i64,
    ) -> PyResult<PyOdometryResult> {
        let stamp = Stamp::from_ns(stamp_ns);
        let Some(depth_m) = depth_m else {
            return Ok(PyOdometryResult(self.odometry.push_without_depth(stamp)));
        };
        let size = (self.camera.0.width(), self.camera.0.height());
        let image = Image::new(depth_m, "depth_m", size, &self.along)?;
        let odometry = &mut self.odometry;
        py.detach(|| odometry.push(image.view(), stamp))
            .into_python()
            .map(PyOdometryResult)
    }
}
