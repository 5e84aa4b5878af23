//! `RangeFlow`: the point-wise peer of the geometric flow.

use crate::camera::PyCamera;
use crate::config::{keywords, settings};
use crate::errors::{IntoPython, Kind, exception};
use crate::trajectory::pose_from;

use crate::motion_arguments::Image;
use crate::velocity::PyVelocityEstimate;
use pyo3::prelude::*;
use sphereflow_baselines::{RangeFlow, RangeFlowConfig};
use sphereflow_core::Pose;

/// Velocities by point-wise range flow: the peer that the weak form is measured against.
///
/// One equation for each block of pixels, with the gradient of the inverse range as a central
/// difference, by reweighted least squares on a pyramid with warping (Spies et al. 2002; DIFODO,
/// Jaimez and Gonzalez-Jimenez 2015). Noise in the gradients shrinks its velocities; for anything
/// but comparisons use `estimate_velocity`.
///
/// Parameters
/// ----------
/// camera : Camera
///     The depth camera, any model.
/// config : sphereflow.config.RangeFlowConfig, optional
///     All settings. `levels`, where given, replaces what it says.
/// levels : sequence of int, optional
///     Sides of the blocks of pixels that are averaged, one solve each, coarse to fine.
/// along : {'axis', 'ray'}
///     What the images hold: depth along the optical axis, or range along the ray (360 degrees).
///
/// Raises
/// ------
/// ValueRangeError
///     Naming the argument; also where the image is too small for a level.
#[pyclass(name = "RangeFlow", module = "sphereflow.odometry")]
pub struct PyRangeFlow {
    flow: RangeFlow,
    along: String,
}

#[pymethods]
impl PyRangeFlow {
    #[new]
    #[pyo3(signature = (camera, *, config = None, levels = None, along = "axis"))]
    fn new(
        camera: &PyCamera,
        config: Option<&Bound<'_, PyAny>>,
        levels: Option<Vec<usize>>,
        along: &str,
    ) -> PyResult<Self> {
        if !matches!(along, "axis" | "ray") {
            let text = format!("along: expected 'axis' (depth) or 'ray' (range), found '{along}'");
            return Err(exception(Kind::Value, text));
        }
        let mut config: RangeFlowConfig = settings(config)?;
        keywords!(config { levels = levels });
        Ok(Self {
            flow: RangeFlow::new(&camera.0, config).into_python()?,
            along: along.into(),
        })
    }

    /// The camera.
    #[getter]
    fn camera(&self) -> PyCamera {
        PyCamera(self.flow.camera().clone())
    }

    /// Sides of the averaged blocks, pixels, coarse to fine.
    #[getter]
    fn levels(&self) -> Vec<usize> {
        self.flow.config().levels.clone()
    }

    /// Velocity between two depth images.
    ///
    /// Parameters
    /// ----------
    /// depth0_m, depth1_m : array_like of float, (H, W)
    ///     Metres; NaN, zero or negative is unknown. Integers are refused: raw counts are not metres.
    /// dt_s : float
    ///     Seconds from the first to the second image.
    /// guess : array_like, (4, 4), optional
    ///     First guess of the motion `first_from_second`; none where absent.
    ///
    /// Returns
    /// -------
    /// VelocityEstimate
    ///     As of `estimate_velocity`; its `domains` counts the blocks that had an equation. Images that
    ///     cannot be used are a status, not an error.
    ///
    /// Raises
    /// ------
    /// ShapeError, DtypeError, ValueRangeError
    ///     Naming the argument.
    #[pyo3(signature = (depth0_m, depth1_m, dt_s, *, guess = None))]
    fn estimate(
        &mut self,
        py: Python<'_>,
        depth0_m: &Bound<'_, PyAny>,
        depth1_m: &Bound<'_, PyAny>,
        dt_s: f64,
        guess: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyVelocityEstimate> {
        let size = (self.flow.camera().width(), self.flow.camera().height());
        let first = Image::new(depth0_m, "depth0_m", size, &self.along)?;
        let second = Image::new(depth1_m, "depth1_m", size, &self.along)?;
        let guess = guess.map(|pose| pose_from(pose, "guess")).transpose()?;
        let guess = guess.unwrap_or_else(Pose::identity);
        let flow = &mut self.flow;
        py.detach(|| flow.estimate_from(first.view(), second.view(), dt_s, &guess))
            .into_python()
            .map(PyVelocityEstimate)
    }
}
