//! `sphereflow.depth`: the observers and the variational methods of the thesis.

use crate::camera::PyCamera;
use crate::config::{DepthObserverConfig, FlowObserverConfig, keywords, settings};
use crate::depth::{PyDepthResult, twist};
use crate::errors::IntoPython;
use crate::flow::{flow_from, grey, plane_array};
use crate::plain::{dict_of, item};
use crate::reduce::{Reduced, reduced};
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sphereflow_core::checks::positive;
use sphereflow_depth::{
    DataTerm, DepthObserver, FlowObserver, PixelRays, SobolevConfig, SobolevDepth, TvDepth,
    TvDepthConfig, VariationalDepth,
};

/// The observer that takes optical flow and known velocities.
///
/// Parameters
/// ----------
/// camera : Camera
///     Any model.
/// config : sphereflow.config.FlowObserverConfig, optional
///     All settings. The keywords that follow, where given, replace what it says.
/// gain : float, optional
///     k, seconds per metre.
/// initial_range_m : float, optional
///     Range everywhere at the start, metres.
#[pyclass(name = "FlowObserver", module = "sphereflow.depth")]
pub struct PyFlowObserver(FlowObserver);

#[pymethods]
impl PyFlowObserver {
    #[new]
    #[pyo3(signature = (camera, *, config = None, gain = None, initial_range_m = None))]
    fn new(
        camera: &PyCamera,
        config: Option<&Bound<'_, PyAny>>,
        gain: Option<f64>,
        initial_range_m: Option<f64>,
    ) -> PyResult<Self> {
        let FlowObserverConfig(mut config) = settings(config)?;
        keywords!(config {
            gain = gain,
            initial_range_m = initial_range_m,
        });
        let rays = PixelRays::new(&camera.0).into_python()?;
        FlowObserver::new(&rays, config).into_python().map(Self)
    }

    /// Steps ahead with the flow between two images, (H, W, 2) pixels, and the velocities between them.
    ///
    /// Returns a `DepthResult` at the time of the second image; `std_m` is None.
    #[pyo3(signature = (flow, *, v_m_s, omega_rad_s, dt_s))]
    fn step(
        &mut self,
        py: Python<'_>,
        flow: &Bound<'_, PyAny>,
        v_m_s: &Bound<'_, PyAny>,
        omega_rad_s: &Bound<'_, PyAny>,
        dt_s: f64,
    ) -> PyResult<PyDepthResult> {
        let (flow, twist) = (flow_from(flow, "flow")?, twist(v_m_s, omega_rad_s)?);
        let observer = &mut self.0;
        let status = py
            .detach(|| observer.step(&flow, &twist, dt_s))
            .into_python()?;
        PyDepthResult::of_observer(py, self.0.range(), status)
    }
}

/// The observer that takes inverse ranges, as `sobolev_depth` and `tv_l1_depth` give them.
///
/// Parameters
/// ----------
/// camera : Camera
///     Any model.
/// config : sphereflow.config.DepthObserverConfig, optional
///     All settings. The keywords that follow, where given, replace what it says.
/// gain : float, optional
///     k, metres per second.
/// initial_range_m : float, optional
///     Range everywhere at the start, metres.
#[pyclass(name = "DepthObserver", module = "sphereflow.depth")]
pub struct PyDepthObserver(DepthObserver);

#[pymethods]
impl PyDepthObserver {
    #[new]
    #[pyo3(signature = (camera, *, config = None, gain = None, initial_range_m = None))]
    fn new(
        camera: &PyCamera,
        config: Option<&Bound<'_, PyAny>>,
        gain: Option<f64>,
        initial_range_m: Option<f64>,
    ) -> PyResult<Self> {
        let DepthObserverConfig(mut config) = settings(config)?;
        keywords!(config {
            gain = gain,
            initial_range_m = initial_range_m,
        });
        let rays = PixelRays::new(&camera.0).into_python()?;
        DepthObserver::new(&rays, config).into_python().map(Self)
    }

    /// Steps ahead with an inverse range, (H, W) per metre, NaN unknown, and the velocities.
    ///
    /// Returns a `DepthResult` at the time of the second image; `std_m` is None.
    #[pyo3(signature = (inv_range, *, v_m_s, omega_rad_s, dt_s))]
    fn step(
        &mut self,
        py: Python<'_>,
        inv_range: &Bound<'_, PyAny>,
        v_m_s: &Bound<'_, PyAny>,
        omega_rad_s: &Bound<'_, PyAny>,
        dt_s: f64,
    ) -> PyResult<PyDepthResult> {
        let (inverse, twist) = (grey(inv_range, "inv_range")?, twist(v_m_s, omega_rad_s)?);
        let observer = &mut self.0;
        let status = py
            .detach(|| observer.step(&inverse, &twist, dt_s))
            .into_python()?;
        PyDepthResult::of_observer(py, self.0.range(), status)
    }
}

/// Inverse range by a variational method.
#[pyclass(name = "VariationalDepth", module = "sphereflow.depth", frozen)]
pub struct PyVariationalDepth {
    inv_range: Py<PyArray2<f32>>,
    energy: f64,
    residual: f64,
    iterations: usize,
}

impl PyVariationalDepth {
    /// From the state that `__reduce__` gives.
    pub fn from_state(state: &Bound<'_, PyAny>) -> PyResult<Self> {
        let dict = dict_of(state)?;
        Ok(Self {
            inv_range: item(dict, "inv_range")?.extract::<Py<PyArray2<f32>>>()?,
            energy: item(dict, "energy")?.extract()?,
            residual: item(dict, "residual")?.extract()?,
            iterations: item(dict, "iterations")?.extract()?,
        })
    }
}

#[pymethods]
impl PyVariationalDepth {
    /// 1/D per metre, (H, W); NaN where unknown, everywhere without translation.
    #[getter]
    fn inv_range(&self, py: Python<'_>) -> Py<PyArray2<f32>> {
        self.inv_range.clone_ref(py)
    }

    /// The functional at the solution.
    #[getter]
    fn energy(&self) -> f64 {
        self.energy
    }

    /// What is left to gain: relative residual (Sobolev) or relative duality gap (TV-L1).
    #[getter]
    fn residual(&self) -> f64 {
        self.residual
    }

    /// Iterations used.
    #[getter]
    fn iterations(&self) -> usize {
        self.iterations
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        let state = PyDict::new(py);
        state.set_item("inv_range", self.inv_range.bind(py))?;
        state.set_item("energy", self.energy)?;
        state.set_item("residual", self.residual)?;
        state.set_item("iterations", self.iterations)?;
        reduced(py, "VariationalDepth", state.into_any())
    }
}

fn result(py: Python<'_>, depth: VariationalDepth) -> PyResult<PyVariationalDepth> {
    Ok(PyVariationalDepth {
        inv_range: plane_array(py, depth.inv_range)?.unbind(),
        energy: depth.energy,
        residual: depth.residual,
        iterations: depth.iterations,
    })
}

/// Inverse range from two images and known velocities: least squares, smooth on the sphere.
///
/// Parameters
/// ----------
/// camera : Camera
///     Any model.
/// image0, image1 : array_like, (H, W)
///     Brightness from 1 to 256.
/// v_m_s, omega_rad_s : array_like, (3,)
///     Velocities between the images, camera frame.
/// dt_s : float
///     Seconds between the images.
/// config : sphereflow.config.SobolevConfig, optional
///     All settings. The keywords that follow, where given, replace what it says.
/// alpha_m_s : float, optional
///     Weight of smoothness, metres per second.
/// iterations : int, optional
///     Iterations of the multigrid solver at most.
/// start : array_like, (H, W), optional
///     Inverse range to start from.
///
/// Raises
/// ------
/// ShapeError, DtypeError, ValueRangeError
///     Naming the argument.
#[pyfunction]
#[pyo3(name = "sobolev_depth", signature = (camera, image0, image1, *, v_m_s, omega_rad_s, dt_s, config = None, alpha_m_s = None, iterations = None, start = None))]
#[allow(clippy::too_many_arguments)] // keyword arguments of Python
pub fn py_sobolev_depth(
    py: Python<'_>,
    camera: &PyCamera,
    image0: &Bound<'_, PyAny>,
    image1: &Bound<'_, PyAny>,
    v_m_s: &Bound<'_, PyAny>,
    omega_rad_s: &Bound<'_, PyAny>,
    dt_s: f64,
    config: Option<&Bound<'_, PyAny>>,
    alpha_m_s: Option<f64>,
    iterations: Option<usize>,
    start: Option<&Bound<'_, PyAny>>,
) -> PyResult<PyVariationalDepth> {
    let (image0, image1) = (grey(image0, "image0")?, grey(image1, "image1")?);
    let twist = twist(v_m_s, omega_rad_s)?;
    let start = start.map(|start| grey(start, "start")).transpose()?;
    let mut config: SobolevConfig = settings(config)?;
    keywords!(config {
        alpha_m_s = alpha_m_s,
        iterations = iterations,
    });
    let found = py.detach(|| {
        let rays = PixelRays::new(&camera.0)?;
        let data = DataTerm::of_pair(&rays, &image0, &image1, &twist, dt_s)?;
        SobolevDepth::new(&rays, config)?.solve(&data, start.as_ref())
    });
    result(py, found.into_python()?)
}

/// Inverse range from two images and known velocities: total variation, absolute data term.
///
/// Parameters
/// ----------
/// camera : Camera
///     Any model.
/// image0, image1 : array_like, (H, W)
///     Brightness from 1 to 256.
/// v_m_s, omega_rad_s : array_like, (3,)
///     Velocities between the images, camera frame.
/// dt_s : float
///     Seconds between the images.
/// config : sphereflow.config.TvDepthConfig, optional
///     All settings. The keywords that follow, where given, replace what it says.
/// weight : float, optional
///     Weight of the data: the thesis's alpha squared.
/// iterations : int, optional
///     Iterations at most.
/// gap : float, optional
///     Relative duality gap at which to stop, 0 to use all iterations.
/// start : array_like, (H, W), optional
///     Inverse range to start from.
///
/// Raises
/// ------
/// ShapeError, DtypeError, ValueRangeError
///     Naming the argument.
#[pyfunction]
#[pyo3(name = "tv_l1_depth", signature = (camera, image0, image1, *, v_m_s, omega_rad_s, dt_s, config = None, weight = None, iterations = None, gap = None, start = None))]
#[allow(clippy::too_many_arguments)] // keyword arguments of Python
pub fn py_tv_l1_depth(
    py: Python<'_>,
    camera: &PyCamera,
    image0: &Bound<'_, PyAny>,
    image1: &Bound<'_, PyAny>,
    v_m_s: &Bound<'_, PyAny>,
    omega_rad_s: &Bound<'_, PyAny>,
    dt_s: f64,
    config: Option<&Bound<'_, PyAny>>,
    weight: Option<f64>,
    iterations: Option<usize>,
    gap: Option<f64>,
    start: Option<&Bound<'_, PyAny>>,
) -> PyResult<PyVariationalDepth> {
    let (image0, image1) = (grey(image0, "image0")?, grey(image1, "image1")?);
    let twist = twist(v_m_s, omega_rad_s)?;
    let start = start.map(|start| grey(start, "start")).transpose()?;
    if let Some(weight) = weight {
        positive("weight", weight).into_python()?;
    }
    let mut config: TvDepthConfig = settings(config)?;
    keywords!(config {
        lambda = weight,
        iterations = iterations,
        gap = gap,
    });
    let found = py.detach(|| {
        let rays = PixelRays::new(&camera.0)?;
        let data = DataTerm::of_pair(&rays, &image0, &image1, &twist, dt_s)?;
        TvDepth::new(&rays, config)?.solve(&data, start.as_ref())
    });
    result(py, found.into_python()?)
}
