//! `DepthOdometry`: poses of a moving depth camera.

use crate::camera::PyCamera;
use crate::config::{keywords, settings};
use crate::errors::{IntoPython, Kind, exception};
use crate::motion_arguments::{
    Image, deviation, matrix6, reason, vector3, vector3_of, with_keywords,
};
use crate::plain::{Plain, reason_values};
use crate::reduce::{Reduced, reduced};
use crate::trajectory::pose_matrix;
use nalgebra::{Matrix6, Vector3};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sphereflow_alignment::CovarianceModel;
use sphereflow_core::ReasonCode;
use sphereflow_core::{Stamp, Twist};
use sphereflow_odometry::{DepthOdometry, Gyro, OdometryConfig, OdometryResult};

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

    /// Number of the keyframe that the frame was measured against; None where not measured.
    #[getter]
    fn keyframe(&self) -> Option<usize> {
        self.0.keyframe_motion.map(|motion| motion.keyframe)
    }

    /// Pose of the camera in its keyframe's frame, (4, 4); None where not measured.
    #[getter]
    fn keyframe_from_camera<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let motion = self.0.keyframe_motion;
        motion
            .map(|motion| pose_matrix(py, &motion.keyframe_from_camera))
            .transpose()
    }

    /// Covariance of `keyframe_from_camera`, order [rotation, translation], radians and metres, in
    /// the keyframe's frame, (6, 6); None where not measured.
    #[getter]
    fn keyframe_covariance<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let motion = self.0.keyframe_motion;
        motion
            .map(|motion| matrix6(py, &motion.covariance))
            .transpose()
    }

    /// Share of the domains that do not move with the rest: moving objects; NaN where not measured.
    #[getter]
    fn rejected_share(&self) -> f64 {
        self.0
            .estimate
            .as_ref()
            .map_or(f64::NAN, |estimate| estimate.rejected_share)
    }

    /// Share of the domains that clearly follow one other rigid motion: a large moving object, or
    /// the world behind it; NaN where not measured.
    #[getter]
    fn divided_share(&self) -> f64 {
        self.0
            .estimate
            .as_ref()
            .map_or(f64::NAN, |estimate| estimate.divided_share)
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

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        reduced(py, "OdometryResult", self.0.to_plain(py)?)
    }
}

/// Poses of a moving depth camera, one frame at a time.
///
/// The world is the camera frame of the first frame. Each frame is measured against a keyframe, so
/// that errors do not add up frame by frame; `sphereflow.Engine` also compares the keyframes with
/// each other. Results are the same for any number of threads.
///
/// Parameters
/// ----------
/// camera : Camera
///     The depth camera, any model.
/// config : sphereflow.config.OdometryConfig, optional
///     All settings. The keywords that follow, where given, replace what it says.
/// method, along, domains, max_std_m, noise
///     As in `estimate_velocity`.
/// keyframes : bool, optional
///     False measures every frame against the one before.
/// readout_s : float, optional
///     Rolling shutter: seconds between the exposures of the first and the last row, the stamp being
///     the middle row's; 0 where all rows are exposed at once, 0.03 for a Kinect v1.
/// depth_corrected : bool
///     True where the depth's distortion was calibrated: the covariance then has no part that grows
///     with the motion.
#[pyclass(name = "DepthOdometry", module = "sphereflow.odometry")]
pub struct PyDepthOdometry {
    odometry: DepthOdometry,
    camera: PyCamera,
    along: String,
}

#[pymethods]
impl PyDepthOdometry {
    #[new]
    #[pyo3(signature = (camera, *, config = None, method = None, along = "axis",
        domains = None, max_std_m = None, keyframes = None, readout_s = None,
        depth_corrected = false, noise = None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        camera: &PyCamera,
        config: Option<&Bound<'_, PyAny>>,
        method: Option<&str>,
        along: &str,
        domains: Option<usize>,
        max_std_m: Option<f64>,
        keyframes: Option<bool>,
        readout_s: Option<f64>,
        depth_corrected: bool,
        noise: Option<&str>,
    ) -> PyResult<Self> {
        let mut config: OdometryConfig = settings(config)?;
        config.alignment = with_keywords(config.alignment, method, domains, max_std_m, noise)?;
        keywords!(config {
            readout_s = readout_s,
            keyframes.enabled = keyframes,
        });
        if depth_corrected {
            config.alignment.covariance.motion_share = CovarianceModel::calibrated().motion_share;
        }
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

    /// Keyframes so far.
    #[getter]
    fn keyframe_count(&self) -> usize {
        self.odometry.keyframe_count()
    }

    /// The next frame.
    ///
    /// Parameters
    /// ----------
    /// depth_m : array_like of float, (H, W), or None
    ///     Metres, NaN or zero unknown; None where the frame has no depth image.
    /// stamp_ns : int
    ///     Nanoseconds. A stamp that does not increase is skipped, with a reason.
    /// gyro_rad_s : array_like, (3,), optional
    ///     Mean angular velocity since the last measured frame, bias removed, in the camera's frame.
    /// gyro_std_rad_s : float
    ///     Its standard deviation; 0 holds the rotation fixed.
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
    /// ShapeError, DtypeError, ValueRangeError
    ///     Naming the argument; the odometry is as before.
    #[pyo3(signature = (depth_m, stamp_ns, *, gyro_rad_s = None, gyro_std_rad_s = 3e-3))]
    fn push(
        &mut self,
        py: Python<'_>,
        depth_m: Option<&Bound<'_, PyAny>>,
        stamp_ns: i64,
        gyro_rad_s: Option<&Bound<'_, PyAny>>,
        gyro_std_rad_s: f64,
    ) -> PyResult<PyOdometryResult> {
        let stamp = Stamp::from_ns(stamp_ns);
        let std_rad_s = deviation(gyro_std_rad_s, "gyro_std_rad_s", true)?;
        let rate = gyro_rad_s
            .map(|v| vector3_of(v, "gyro_rad_s"))
            .transpose()?;
        let Some(depth_m) = depth_m else {
            return Ok(PyOdometryResult(self.odometry.push_without_depth(stamp)));
        };
        let gyro = rate.map(|rate_rad_s| Gyro {
            rate_rad_s,
            std_rad_s,
        });
        let size = (self.camera.0.width(), self.camera.0.height());
        let image = Image::new(depth_m, "depth_m", size, &self.along)?;
        let odometry = &mut self.odometry;
        py.detach(|| odometry.push_with_gyro(image.view(), stamp, gyro))
            .into_python()
            .map(PyOdometryResult)
    }
}
