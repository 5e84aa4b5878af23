//! `sphereflow.depth`: the depth filter.

use crate::camera::PyCamera;
use crate::config::{keywords, settings};
use crate::errors::{IntoPython, Kind, exception};
use crate::flow::{grey, plane_array};
use crate::motion_arguments::{deviation, vector3_of};
use crate::plain::{Plain, dict_of, field, item, named, reason_values};
use crate::reduce::{Reduced, reduced};
use crate::trajectory::{pose_from, pose_matrix};
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sphereflow_core::ReasonCode;
use sphereflow_core::{Plane, Stamp, Twist};
use sphereflow_depth::{
    Brightness, DepthFilter, DepthFilterConfig, DepthStatus, PoseNoise, VelocityNoise,
};

/// Range and its standard deviation after a step, and what became of the image.
#[pyclass(name = "DepthResult", module = "sphereflow.depth", frozen)]
pub struct PyDepthResult {
    range: Py<PyArray2<f32>>,
    std: Option<Py<PyArray2<f32>>>,
    status: DepthStatus,
    sigma_grey: f32,
    fitting_share: f32,
}

impl PyDepthResult {
    /// Of an observer, which knows no deviation.
    pub fn of_observer(py: Python<'_>, range: &Plane<f32>, status: DepthStatus) -> PyResult<Self> {
        Ok(Self {
            range: plane_array(py, range.clone())?.unbind(),
            std: None,
            status,
            sigma_grey: f32::NAN,
            fitting_share: f32::NAN,
        })
    }

    /// From the state that `__reduce__` gives.
    pub fn from_state(state: &Bound<'_, PyAny>) -> PyResult<Self> {
        let dict = dict_of(state)?;
        Ok(Self {
            range: item(dict, "range")?.extract::<Py<PyArray2<f32>>>()?,
            std: item(dict, "std")?.extract::<Option<Py<PyArray2<f32>>>>()?,
            status: field(dict, "status")?,
            sigma_grey: item(dict, "sigma_grey")?.extract()?,
            fitting_share: item(dict, "fitting_share")?.extract()?,
        })
    }
}

#[pymethods]
impl PyDepthResult {
    /// Range along the ray, metres, (H, W); NaN where the camera has no ray.
    #[getter]
    fn range_m(&self, py: Python<'_>) -> Py<PyArray2<f32>> {
        self.range.clone_ref(py)
    }

    /// Standard deviation of the range, metres, (H, W); None from an observer, which has none.
    #[getter]
    fn std_m(&self, py: Python<'_>) -> Option<Py<PyArray2<f32>>> {
        self.std.as_ref().map(|std| std.clone_ref(py))
    }

    /// "started", "updated", "unobservable", "unusable" or "skipped".
    #[getter]
    fn status(&self) -> &'static str {
        self.status.name()
    }

    /// Why, where it is neither "started" nor "updated".
    #[getter]
    fn reason(&self) -> Option<String> {
        self.status.reason().map(|reason| reason.to_string())
    }

    /// Stable code of the reason, in snake_case (docs/reason-codes.md); None where there is none.
    #[getter]
    fn reason_code(&self) -> Option<&'static str> {
        self.status.reason().map(|why| why.code())
    }

    /// The values that decided, by name; empty where there is no reason.
    #[getter]
    fn reason_values<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        reason_values(py, self.status.reason().as_ref())
    }

    /// Standard deviation of the image noise that was used, grey levels of the binned image; NaN
    /// from an observer.
    #[getter]
    fn sigma_grey(&self) -> f32 {
        self.sigma_grey
    }

    /// Share of the compared pixels that fit, 0 to 1; NaN where none was compared.
    #[getter]
    fn fitting_share(&self) -> f32 {
        self.fitting_share
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        let state = PyDict::new(py);
        state.set_item("range", self.range.bind(py))?;
        state.set_item("std", &self.std)?;
        state.set_item("status", self.status.to_plain(py)?)?;
        state.set_item("sigma_grey", self.sigma_grey)?;
        state.set_item("fitting_share", self.fitting_share)?;
        reduced(py, "DepthResult", state.into_any())
    }

    fn __repr__(&self) -> String {
        let reason = self.status.reason().map(|why| format!(": {why}"));
        format!(
            "DepthResult({}{})",
            self.status.name(),
            reason.unwrap_or_default()
        )
    }
}

/// Both velocities.
pub fn twist(v_m_s: &Bound<'_, PyAny>, omega_rad_s: &Bound<'_, PyAny>) -> PyResult<Twist> {
    Ok(Twist {
        angular_rad_s: vector3_of(omega_rad_s, "omega_rad_s")?,
        linear_m_s: vector3_of(v_m_s, "v_m_s")?,
    })
}

/// Dense range from the images of an ordinary camera whose motion is known.
///
/// Keeps an inverse depth with its information in every pixel, carries it along by the exact motion,
/// corrects it by comparing each image with several of the past, and regularises it by planes. The
/// noise of the images is measured, changes of light are, and pixels hidden in past images are left
/// out.
///
/// Parameters
/// ----------
/// camera : Camera
///     Any model; a pinhole is fastest.
/// config : sphereflow.config.DepthFilterConfig, optional
///     All settings. The keywords that follow, where given, replace what it says.
/// binning : int, optional
///     Pixels to a side of one of the filter's, 1 to 4.
/// lags : sequence of int, optional
///     Distances in frames to the past images that are compared. Made for 60 Hz; halve them at 30. All
///     images up to the longest are kept, at twenty bytes per pixel of the filter. At the start the first
///     image stands in for those that are not there yet.
/// sigma_grey : float, optional
///     Standard deviation of the image noise, grey levels; measured where not given.
/// initial_range_m : float, optional
///     Range everywhere at the start, metres.
/// roughness_per_m_rad : float, optional
///     How much inverse depth departs from planes, per metre and radian.
/// brightness : {'measured', 'constant'}, optional
///     Whether changes of light are measured and taken out.
/// occlusion : bool, optional
///     Whether past images are left out where a pixel was hidden.
/// keyframes : int, optional
///     States of the past that are kept, at most, so that surfaces which come into view again are known at
///     once; 0 for none. Each takes eight bytes per pixel of the filter. Only with `occlusion`.
#[pyclass(name = "DepthFilter", module = "sphereflow.depth")]
pub struct PyDepthFilter {
    filter: DepthFilter,
}

#[pymethods]
impl PyDepthFilter {
    #[new]
    #[pyo3(signature = (camera, *, config = None, binning = None, lags = None, sigma_grey = None,
        initial_range_m = None, roughness_per_m_rad = None, brightness = None, occlusion = None,
        keyframes = None))]
    #[allow(clippy::too_many_arguments)] // keyword arguments of Python
    fn new(
        camera: &PyCamera,
        config: Option<&Bound<'_, PyAny>>,
        binning: Option<usize>,
        lags: Option<Vec<usize>>,
        sigma_grey: Option<f64>,
        initial_range_m: Option<f64>,
        roughness_per_m_rad: Option<f64>,
        brightness: Option<&str>,
        occlusion: Option<bool>,
        keyframes: Option<usize>,
    ) -> PyResult<Self> {
        let mut config: DepthFilterConfig = settings(config)?;
        let brightness = brightness.map(|word| named::<Brightness>(word, "brightness"));
        let brightness = brightness.transpose()?;
        keywords!(config {
            binning = binning,
            lags = lags,
            sigma_grey = sigma_grey.map(Some),
            initial_range_m = initial_range_m,
            roughness_per_m_rad = roughness_per_m_rad,
            brightness = brightness,
            occlusion = occlusion,
            keyframes = keyframes,
        });
        let filter = DepthFilter::new(&camera.0, config).into_python()?;
        Ok(Self { filter })
    }

    /// The camera.
    #[getter]
    fn camera(&self) -> PyCamera {
        PyCamera(self.filter.camera().clone())
    }

    /// Pose of the last image, as given or integrated, (4, 4).
    #[getter]
    fn world_from_camera<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        pose_matrix(py, &self.filter.world_from_camera())
    }

    /// The next image, with its pose or with the velocities since the one before.
    ///
    /// Parameters
    /// ----------
    /// image : array_like, (H, W)
    ///     Brightness from 1 to 256, NaN unknown.
    /// world_from_camera : array_like, (4, 4), with stamp_ns
    ///     Pose of the image, exact but for a noise.
    /// position_sigma_m, rotation_sigma_rad : float
    ///     Standard deviation of the pose, each axis and each pose for itself. What the images show of
    ///     such errors is put right. Poses of trackers, with another clock than the images: 0.002 m and
    ///     0.002 rad; 0 takes them for exact.
    /// stamp_ns : int
    ///     Nanoseconds. A stamp that does not increase is skipped, with a reason.
    /// v_m_s, omega_rad_s : array_like, (3,), with dt_s
    ///     Velocities since the image before, camera frame; the pose is integrated.
    /// dt_s : float
    ///     Seconds since the image before.
    /// v_sigma_m_s, omega_sigma_rad_s : float
    ///     Standard deviation of the velocities, each axis and step for itself.
    ///
    /// Returns
    /// -------
    /// DepthResult
    ///     `range_m`, `std_m`, and `status` with its `reason`: without translation depth is not
    ///     observable, a black or saturated image is not usable; the state is then carried along.
    ///
    /// Raises
    /// ------
    /// ShapeError, DtypeError, ValueRangeError
    ///     Naming the argument; the filter is as before.
    #[pyo3(signature = (image, *, world_from_camera = None, stamp_ns = None, v_m_s = None, omega_rad_s = None, dt_s = None, v_sigma_m_s = 0.0, omega_sigma_rad_s = 0.0, position_sigma_m = 0.0, rotation_sigma_rad = 0.0))]
    #[allow(clippy::too_many_arguments)] // keyword arguments of Python
    fn step(
        &mut self,
        py: Python<'_>,
        image: &Bound<'_, PyAny>,
        world_from_camera: Option<&Bound<'_, PyAny>>,
        stamp_ns: Option<i64>,
        v_m_s: Option<&Bound<'_, PyAny>>,
        omega_rad_s: Option<&Bound<'_, PyAny>>,
        dt_s: Option<f64>,
        v_sigma_m_s: f64,
        omega_sigma_rad_s: f64,
        position_sigma_m: f64,
        rotation_sigma_rad: f64,
    ) -> PyResult<PyDepthResult> {
        let image = grey(image, "image")?;
        for (value, name) in [
            (v_sigma_m_s, "v_sigma_m_s"),
            (omega_sigma_rad_s, "omega_sigma_rad_s"),
            (position_sigma_m, "position_sigma_m"),
            (rotation_sigma_rad, "rotation_sigma_rad"),
        ] {
            deviation(value, name, true)?;
        }
        let filter = &mut self.filter;
        let step = match (world_from_camera, stamp_ns, v_m_s, omega_rad_s, dt_s) {
            (Some(pose), Some(stamp_ns), None, None, None) => {
                let pose = pose_from(pose, "world_from_camera")?;
                let noise = PoseNoise {
                    rotation_rad: rotation_sigma_rad,
                    position_m: position_sigma_m,
                };
                let stamp = Stamp::from_ns(stamp_ns);
                py.detach(|| filter.step_with_noise(&image, &pose, noise, stamp))
            }
            (None, None, Some(v), Some(omega), Some(dt_s)) => {
                let twist = twist(v, omega)?;
                let noise = VelocityNoise {
                    angular_rad_s: omega_sigma_rad_s,
                    linear_m_s: v_sigma_m_s,
                };
                py.detach(|| filter.step_with_velocity(&image, &twist, dt_s, noise))
            }
            _ => {
                let text = "step: expected either world_from_camera and stamp_ns, or v_m_s, \
                            omega_rad_s and dt_s, found another combination";
                return Err(exception(Kind::Value, text));
            }
        }
        .into_python()?;
        let (range, std) = py.detach(|| filter.range());
        Ok(PyDepthResult {
            range: plane_array(py, range)?.unbind(),
            std: Some(plane_array(py, std)?.unbind()),
            status: step.status,
            sigma_grey: step.sigma_grey,
            fitting_share: step.fitting_share,
        })
    }
}
