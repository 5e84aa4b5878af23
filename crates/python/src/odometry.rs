//! `estimate_velocity` and `DepthOdometry`.

use crate::arrays::metres;
use crate::camera::PyCamera;
use crate::errors::{IntoPython, Kind, core_error, exception};
use crate::trajectory::pose_matrix;
use nalgebra::{Matrix6, Vector3, Vector6};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sphereflow_core::{DepthMap, RangeMap, Stamp, TrackStatus, Twist};
use sphereflow_odometry::{
    Config, DepthImage, DepthOdometry, Error, OdometryResult, VelocityEstimate, estimate_velocity,
};

impl<T> IntoPython<T> for Result<T, Error> {
    fn into_python(self) -> PyResult<T> {
        self.map_err(|error| match error {
            Error::Core(error) => core_error(&error),
        })
    }
}

/// A depth image of the camera's size: along the axis, or along the ray where `along == "ray"`.
enum Image {
    Depth(DepthMap),
    Range(RangeMap),
}

impl Image {
    fn new(
        value: &Bound<'_, PyAny>,
        name: &str,
        size: (usize, usize),
        along: &str,
    ) -> PyResult<Self> {
        let plane = metres(value, name, Some(size))?;
        match along {
            "axis" => Ok(Self::Depth(DepthMap::new(plane))),
            "ray" => Ok(Self::Range(RangeMap::new(plane))),
            other => Err(exception(
                Kind::Value,
                format!("along: expected 'axis' (depth) or 'ray' (range), found '{other}'"),
            )),
        }
    }

    fn view(&self) -> DepthImage<'_> {
        match self {
            Self::Depth(map) => map.into(),
            Self::Range(map) => map.into(),
        }
    }
}

fn vector3<'py>(py: Python<'py>, v: &Vector3<f64>) -> Bound<'py, PyArray1<f64>> {
    PyArray1::from_slice(py, v.as_slice())
}

fn matrix6<'py>(py: Python<'py>, m: &Matrix6<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_iter(py, (0..36).map(|i| m[(i / 6, i % 6)])).reshape([6, 6])
}

fn reason(status: &TrackStatus) -> Option<String> {
    status.reason().map(|reason| reason.to_string())
}

/// What two depth images say of the camera's velocity.
#[pyclass(name = "VelocityEstimate", module = "sphereflow.odometry", frozen)]
pub struct PyVelocityEstimate(VelocityEstimate);

impl PyVelocityEstimate {
    fn part(&self, take: impl Fn(&Twist) -> Vector3<f64>) -> Vector3<f64> {
        self.0
            .twist
            .as_ref()
            .map_or(Vector3::repeat(f64::NAN), take)
    }
}

#[pymethods]
impl PyVelocityEstimate {
    /// "tracked", "weak" or "lost".
    #[getter]
    fn status(&self) -> &'static str {
        self.0.status.name()
    }

    /// Why, where it is not "tracked".
    #[getter]
    fn reason(&self) -> Option<String> {
        reason(&self.0.status)
    }

    /// Linear velocity, m/s, body frame of the first image, (3,); NaN where lost.
    #[getter]
    fn linear_m_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector3(py, &self.part(|t| t.linear_m_s))
    }

    /// Angular velocity, rad/s, body frame of the first image, (3,); NaN where lost.
    #[getter]
    fn angular_rad_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector3(py, &self.part(|t| t.angular_rad_s))
    }

    /// Covariance in the order [omega, v], (6, 6); NaN where lost.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix6(py, &self.0.covariance.unwrap_or(Matrix6::repeat(f64::NAN)))
    }

    /// 0 (some motion changes nothing) to 1 (Theorem 3).
    #[getter]
    fn score(&self) -> f64 {
        self.0.score
    }

    /// Poorly determined directions: dicts with direction (6,), std_m_s, score, estimated.
    #[getter]
    fn weak_directions<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let entry = |weak: &sphereflow_odometry::WeakDirection| {
            let dict = PyDict::new(py);
            let direction: &Vector6<f64> = &weak.direction;
            dict.set_item("direction", PyArray1::from_slice(py, direction.as_slice()))?;
            dict.set_item("std_m_s", weak.std_m_s)?;
            dict.set_item("score", weak.score)?;
            dict.set_item("estimated", weak.estimated)?;
            Ok(dict)
        };
        self.0.weak_directions.iter().map(entry).collect()
    }

    /// Share of the image known in both frames, 0 to 1.
    #[getter]
    fn known_share(&self) -> f64 {
        self.0.known_share
    }

    /// Usable domains.
    #[getter]
    fn domains(&self) -> usize {
        self.0.domains
    }

    /// Robust residual in units of the expected noise; NaN where nothing was solved.
    #[getter]
    fn residual_scale(&self) -> f64 {
        self.0.residual_scale
    }

    fn __repr__(&self) -> String {
        let (v, w) = (self.part(|t| t.linear_m_s), self.part(|t| t.angular_rad_s));
        format!(
            "VelocityEstimate({}, linear_m_s=[{:.4}, {:.4}, {:.4}], angular_rad_s=[{:.4}, {:.4}, {:.4}])",
            self.0.status, v.x, v.y, v.z, w.x, w.y, w.z
        )
    }
}

fn config(method: &str, warps: Option<usize>, domains: Option<usize>) -> PyResult<Config> {
    if method != "single" {
        return Err(exception(
            Kind::Value,
            format!("method: expected 'single', found '{method}'"),
        ));
    }
    let default = Config::default();
    Ok(Config {
        warps: warps.unwrap_or(default.warps),
        domains: domains.unwrap_or(default.domains),
        ..default
    })
}

/// Velocity of a camera from two of its depth images: the geometric flow of Chapter 6.
///
/// Parameters
/// ----------
/// camera : Camera
///     The depth camera, any model.
/// depth0_m, depth1_m : array_like of float, (H, W)
///     Metres; NaN, zero or negative is unknown. Integers are refused: raw counts are not metres.
/// dt_s : float
///     Seconds from the first to the second image.
/// method : {'single'}
///     One robust solve, then `warps` more on the second image warped by the estimate.
/// along : {'axis', 'ray'}
///     What the images hold: depth along the optical axis, or range along the ray (360 degrees).
/// warps : int, optional
///     Further solves; 2 where absent.
/// domains : int, optional
///     Number of domains; 500 where absent.
///
/// Returns
/// -------
/// VelocityEstimate
///     Velocities in the body frame of the first image, constant over the interval:
///     `log(first_from_second) / dt_s`; covariance; status with reason. Images that cannot be used are
///     a status, not an error.
///
/// Raises
/// ------
/// ShapeError, DtypeError, ValueRangeError
///     Naming the argument.
#[pyfunction]
#[pyo3(
    name = "estimate_velocity",
    signature = (camera, depth0_m, depth1_m, dt_s, *, method = "single", along = "axis",
        warps = None, domains = None)
)]
#[allow(clippy::too_many_arguments)]
pub fn py_estimate_velocity(
    py: Python<'_>,
    camera: &PyCamera,
    depth0_m: &Bound<'_, PyAny>,
    depth1_m: &Bound<'_, PyAny>,
    dt_s: f64,
    method: &str,
    along: &str,
    warps: Option<usize>,
    domains: Option<usize>,
) -> PyResult<PyVelocityEstimate> {
    let config = config(method, warps, domains)?;
    let size = (camera.0.width(), camera.0.height());
    let first = Image::new(depth0_m, "depth0_m", size, along)?;
    let second = Image::new(depth1_m, "depth1_m", size, along)?;
    py.detach(|| estimate_velocity(&camera.0, first.view(), second.view(), dt_s, &config))
        .into_python()
        .map(PyVelocityEstimate)
}

/// What became of one frame.
#[pyclass(name = "OdometryResult", module = "sphereflow.odometry", frozen)]
pub struct PyOdometryResult(OdometryResult);

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
        let config = config(method, warps, domains)?;
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
