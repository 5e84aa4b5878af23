//! `estimate_velocity`: the velocity between two depth images.

use crate::arrays::brightness;
use crate::camera::PyCamera;
use crate::config::{keywords, settings};
use crate::errors::{IntoPython, Kind, exception};
use crate::motion_arguments::{
    Image, deviation, matrix6, reason, vector3, vector3_of, with_keywords,
};
use crate::plain::Plain;
use crate::plain::reason_values;
use crate::reduce::{Reduced, reduced};
use nalgebra::{Matrix6, Vector3, Vector6};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sphereflow_alignment::{Also, Config, VelocityEstimate, VelocityEstimator, VelocityPrior};
use sphereflow_baselines::{ThesisConfig, ThesisEstimator};
use sphereflow_core::ReasonCode;
use sphereflow_core::Twist;
use sphereflow_odometry::Gyro;
use sphereflow_sphere::Camera;
use std::sync::Mutex;

/// What two depth images say of the camera's velocity.
#[pyclass(name = "VelocityEstimate", module = "sphereflow.odometry", frozen)]
pub struct PyVelocityEstimate(pub VelocityEstimate);

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

    /// Poorly determined directions: dicts with direction (6,), std_m_s, score, estimated,
    /// name ("translation along (1.00, 0.00, 0.00)").
    #[getter]
    fn weak_directions<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let entry = |weak: &sphereflow_alignment::WeakDirection| {
            let dict = PyDict::new(py);
            let direction: &Vector6<f64> = &weak.direction;
            dict.set_item("direction", PyArray1::from_slice(py, direction.as_slice()))?;
            dict.set_item("std_m_s", weak.std_m_s)?;
            dict.set_item("score", weak.score)?;
            dict.set_item("estimated", weak.estimated)?;
            dict.set_item("name", weak.name())?;
            Ok(dict)
        };
        self.0.weak_directions.iter().map(entry).collect()
    }

    /// Share of the image known in both frames, 0 to 1.
    #[getter]
    fn known_share(&self) -> f64 {
        self.0.known_share
    }

    /// Share of the first image's surface within the second, 0 to 1; NaN where nothing was solved.
    #[getter]
    fn overlap(&self) -> f64 {
        self.0.overlap
    }

    /// Median displacement, pixels; NaN where nothing was solved.
    #[getter]
    fn flow_px(&self) -> f64 {
        self.0.flow_px
    }

    /// Share of the domains that do not move with the rest, 0 to 1: moving objects.
    #[getter]
    fn rejected_share(&self) -> f64 {
        self.0.rejected_share
    }

    /// Share of the domains that clearly follow one other rigid motion: a large moving object, or
    /// the world behind it; NaN where not measured.
    #[getter]
    fn divided_share(&self) -> f64 {
        self.0.divided_share
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

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        reduced(py, "VelocityEstimate", self.0.to_plain(py)?)
    }
}

/// The estimator of the last call: its tables take longer to build than a pair to measure.
static KEPT: Mutex<Option<VelocityEstimator>> = Mutex::new(None);

/// The kept estimator where it is for this camera and these settings, a new one otherwise.
fn kept_estimator(
    camera: &Camera,
    config: Config,
) -> Result<VelocityEstimator, sphereflow_core::Error> {
    let kept = KEPT.lock().ok().and_then(|mut kept| kept.take());
    match kept.filter(|kept| kept.camera() == camera && *kept.config() == config) {
        Some(estimator) => Ok(estimator),
        None => VelocityEstimator::new(camera, config),
    }
}

fn keep(estimator: VelocityEstimator) {
    if let Ok(mut kept) = KEPT.lock() {
        *kept = Some(estimator);
    }
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
/// config : sphereflow.config.AlignmentConfig or ThesisConfig, optional
///     All settings; the latter with method 'thesis'. The keywords that follow, where given, replace
///     what it says.
/// method : {'pyramid', 'single', 'thesis'}, optional
///     'pyramid', also where absent: robust solves from coarse to fine, the second image warped by the estimate before
///     each. 'single': one robust solve, for slow motions. 'thesis': the thesis's own balance (6.3) in
///     plain least squares, to reproduce it; pinhole and FOV cameras only.
/// along : {'axis', 'ray'}
///     What the images hold: depth along the optical axis, or range along the ray (360 degrees).
/// domains : int, optional
///     Number of domains; 500 where absent, 200 for 'thesis'.
/// gyro_rad_s : array_like, (3,), optional
///     Angular velocity from a gyroscope, bias removed, in the camera's frame.
/// gyro_std_rad_s : float
///     Its standard deviation; 0 holds the rotation fixed.
/// prior_m_s : array_like, (3,), optional
///     Linear velocity known from elsewhere, body frame.
/// prior_std_m_s : float
///     Its standard deviation.
/// image0, image1 : array_like, (H, W) or (H, W, 3), optional
///     Brightness 0 to 255 of both images, registered to the depth: a second conserved field, which
///     makes planes and corridors observable. Both or none.
/// brightness_weight : float, optional
///     What a block's brightness counts, as a share of an independent measurement; 0.003 where absent.
/// max_std_m : float, optional
///     Directions whose predicted standard deviation over the pair is above this, in metres, are
///     held at what was known before, and the status says so.
/// noise : {'disparity', 'time_of_flight'}, optional
///     How the depth's noise depends on the distance: 'disparity' (structured light, stereo) is the
///     same in 1/Z at all distances, 'time_of_flight' has 2 mm and 0.1 % of the range.
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
    signature = (camera, depth0_m, depth1_m, dt_s, *, config = None, method = None, along = "axis",
        domains = None, gyro_rad_s = None, gyro_std_rad_s = 3e-3, prior_m_s = None,
        prior_std_m_s = 0.1, image0 = None, image1 = None, brightness_weight = None,
        max_std_m = None, noise = None)
)]
#[allow(clippy::too_many_arguments)]
pub fn py_estimate_velocity(
    py: Python<'_>,
    camera: &PyCamera,
    depth0_m: &Bound<'_, PyAny>,
    depth1_m: &Bound<'_, PyAny>,
    dt_s: f64,
    config: Option<&Bound<'_, PyAny>>,
    method: Option<&str>,
    along: &str,
    domains: Option<usize>,
    gyro_rad_s: Option<&Bound<'_, PyAny>>,
    gyro_std_rad_s: f64,
    prior_m_s: Option<&Bound<'_, PyAny>>,
    prior_std_m_s: f64,
    image0: Option<&Bound<'_, PyAny>>,
    image1: Option<&Bound<'_, PyAny>>,
    brightness_weight: Option<f64>,
    max_std_m: Option<f64>,
    noise: Option<&str>,
) -> PyResult<PyVelocityEstimate> {
    let size = (camera.0.width(), camera.0.height());
    let first = Image::new(depth0_m, "depth0_m", size, along)?;
    let second = Image::new(depth1_m, "depth1_m", size, along)?;
    if method == Some("thesis") {
        let also = [
            ("gyro_rad_s", gyro_rad_s.is_some()),
            ("prior_m_s", prior_m_s.is_some()),
            ("image0, image1", image0.is_some() || image1.is_some()),
            ("max_std_m", max_std_m.is_some()),
            ("noise", noise.is_some()),
        ];
        if let Some((name, _)) = also.iter().find(|(_, given)| *given) {
            let text = format!("{name}: expected none with method 'thesis', which cannot use it");
            return Err(exception(Kind::Value, text));
        }
        let mut config: ThesisConfig = settings(config)?;
        keywords!(config { domains = domains });
        return py
            .detach(|| {
                ThesisEstimator::new(&camera.0, config)?.estimate(first.view(), second.view(), dt_s)
            })
            .into_python()
            .map(PyVelocityEstimate);
    }
    let mut config = with_keywords(settings(config)?, method, domains, max_std_m, noise)?;
    keywords!(config {
        brightness_weight = brightness_weight,
    });
    let gyro = gyro_rad_s
        .map(|v| vector3_of(v, "gyro_rad_s"))
        .transpose()?;
    let gyro_std = deviation(gyro_std_rad_s, "gyro_std_rad_s", true)?;
    let linear = prior_m_s.map(|v| vector3_of(v, "prior_m_s")).transpose()?;
    let linear_std = deviation(prior_std_m_s, "prior_std_m_s", false)?;
    let images = match (image0, image1) {
        (None, None) => None,
        (Some(a), Some(b)) => Some((
            brightness(a, "image0", size)?,
            brightness(b, "image1", size)?,
        )),
        _ => {
            let text = "image0, image1: expected both or none, found one";
            return Err(exception(Kind::Value, text));
        }
    };
    let mut prior = gyro.map(|rate_rad_s| {
        Gyro {
            rate_rad_s,
            std_rad_s: gyro_std,
        }
        .prior()
    });
    if let Some(linear) = linear {
        let with = prior.get_or_insert(VelocityPrior::none());
        *with = with.and_linear(linear, linear_std);
    }
    py.detach(|| {
        let also = Also {
            prior,
            brightness: images.as_ref().map(|(a, b)| (a, b)),
        };
        let mut estimator = kept_estimator(&camera.0, config)?;
        let found = estimator.estimate_with(first.view(), second.view(), dt_s, &also);
        keep(estimator);
        found
    })
    .into_python()
    .map(PyVelocityEstimate)
}
