//! `estimate_velocity`: the velocity between two depth images.

use crate::arrays::metres;
use crate::camera::PyCamera;
use crate::errors::{IntoPython, Kind, exception};
use nalgebra::{Matrix6, Vector3, Vector6};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sphereflow_core::{DepthMap, RangeMap, TrackStatus, Twist};
use sphereflow_odometry::{Config, DepthImage, VelocityEstimate, estimate_velocity};

/// A depth image of the camera's size: along the axis, or along the ray where `along == "ray"`.
pub enum Image {
    Depth(DepthMap),
    Range(RangeMap),
}

impl Image {
    /// From an array argument.
    pub fn new(
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

    /// What the estimators take.
    pub fn view(&self) -> DepthImage<'_> {
        match self {
            Self::Depth(map) => map.into(),
            Self::Range(map) => map.into(),
        }
    }
}

pub fn vector3<'py>(py: Python<'py>, v: &Vector3<f64>) -> Bound<'py, PyArray1<f64>> {
    PyArray1::from_slice(py, v.as_slice())
}

pub fn matrix6<'py>(py: Python<'py>, m: &Matrix6<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_iter(py, (0..36).map(|i| m[(i / 6, i % 6)])).reshape([6, 6])
}

pub fn reason(status: &TrackStatus) -> Option<String> {
    status.reason().map(|reason| reason.to_string())
}

/// What two depth images say of the camera's velocity.
#[pyclass(name = "VelocityEstimate", module = "sphereflow.odometry", frozen)]
pub struct PyVelocityEstimate(pub(crate) VelocityEstimate);

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

pub fn config(method: &str, warps: Option<usize>, domains: Option<usize>) -> PyResult<Config> {
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
