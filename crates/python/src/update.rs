//! `Update`: what the engine says of a frame.

use crate::motion_arguments::{matrix6, reason, vector3};
use crate::plain::{Plain, plain_struct, reason_values};
use crate::reduce::{Reduced, reduced};
use crate::trajectory::pose_matrix;
use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sphereflow_core::Twist;
use sphereflow_engine::Update;

plain_struct!(Update {
    stamp,
    world_from_camera,
    covariance,
    status,
    quality,
    segment,
    is_keyframe,
    epoch,
    twist,
    timings,
});

/// What became of a frame at the moment it was pushed.
#[pyclass(name = "Update", module = "sphereflow", frozen)]
pub struct PyUpdate(pub Update);

impl PyUpdate {
    fn part(&self, take: impl Fn(&Twist) -> Vector3<f64>) -> Vector3<f64> {
        let twist = self.0.twist.as_ref();
        twist.map_or(Vector3::repeat(f64::NAN), take)
    }
}

#[pymethods]
impl PyUpdate {
    /// The frame's stamp, nanoseconds.
    #[getter]
    fn stamp_ns(&self) -> i64 {
        self.0.stamp.ns()
    }

    /// "started", "tracked", "weak", "coasting", "lost", "relocalised" or "skipped".
    #[getter]
    fn status(&self) -> &'static str {
        self.0.status.name()
    }

    /// Why, in words, where the status has a reason.
    #[getter]
    fn reason(&self) -> Option<String> {
        reason(&self.0.status)
    }

    /// Why, as a word that stays the same from version to version.
    #[getter]
    fn reason_code(&self) -> Option<&'static str> {
        use sphereflow_core::ReasonCode;
        self.0.status.reason().map(|reason| reason.code())
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

    /// Pose of the camera in the world, (4, 4).
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

    /// Covariance of the pose relative to the start of its segment, order [rotation, translation],
    /// radians and metres, in the current camera frame, (6, 6).
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix6(py, &self.0.covariance)
    }

    /// 0 (some motion changes nothing) to 1 (Theorem 3); NaN where nothing was measured.
    #[getter]
    fn quality(&self) -> f64 {
        self.0.quality
    }

    /// Number of the chain of measurements, from 0.
    #[getter]
    fn segment(&self) -> u32 {
        self.0.segment
    }

    /// True where a keyframe was made on this frame's arrival.
    #[getter]
    fn is_keyframe(&self) -> bool {
        self.0.is_keyframe
    }

    /// Number of the map's state that the pose is in.
    #[getter]
    fn epoch(&self) -> u64 {
        self.0.epoch
    }

    /// Measured linear velocity, m/s, camera's own frame, (3,); NaN where not measured.
    #[getter]
    fn linear_m_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector3(py, &self.part(|t| t.linear_m_s))
    }

    /// Measured angular velocity, rad/s, camera's own frame, (3,); NaN where not measured.
    #[getter]
    fn angular_rad_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector3(py, &self.part(|t| t.angular_rad_s))
    }

    /// Milliseconds spent, by stage.
    #[getter]
    fn timings_ms<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("averaging", 1e3 * self.0.timings.averaging_s)?;
        dict.set_item("estimation", 1e3 * self.0.timings.estimation_s)?;
        Ok(dict)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        reduced(py, "Update", self.0.to_plain(py)?)
    }

    fn __repr__(&self) -> String {
        let p = self.0.world_from_camera.translation;
        format!(
            "Update({} s, {}, position_m=[{:.4}, {:.4}, {:.4}])",
            self.0.stamp, self.0.status, p.x, p.y, p.z
        )
    }
}
