//! `sphereflow.flow`: optical flow between two images, and denoising.

use crate::arrays::floats;
use crate::config::{SolverKind, keywords, parts, settings, solver as solver_of};
use crate::errors::IntoPython;
use crate::plain::named;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use sphereflow_core::Plane;
use sphereflow_core::checks::positive;
use sphereflow_flow::{
    FlowField, HornSchunckConfig, RofConfig, TvL1Config, horn_schunck, rof_denoise, tv_l1,
};

/// An `(H, W)` image of brightness, of any number type.
pub fn grey(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Plane<f32>> {
    let array = floats(value, name, &[None, None])?;
    let (height, width) = (array.shape()[0], array.shape()[1]);
    let data = array.as_slice()?.iter().map(|v| *v as f32).collect();
    Plane::from_vec(width, height, data).into_python()
}

/// An `(H, W)` array of a plane.
pub fn plane_array(py: Python<'_>, plane: Plane<f32>) -> PyResult<Bound<'_, PyArray2<f32>>> {
    let shape = [plane.height(), plane.width()];
    PyArray1::from_vec(py, plane.into_vec()).reshape(shape)
}

/// An `(H, W, 2)` array as a flow in pixels.
pub fn flow_from(value: &Bound<'_, PyAny>, name: &str) -> PyResult<FlowField> {
    let array = floats(value, name, &[None, None, Some(2)])?;
    let (height, width) = (array.shape()[0], array.shape()[1]);
    let data = array.as_slice()?;
    let part = |k: usize| {
        let values = data.iter().skip(k).step_by(2).map(|v| *v as f32).collect();
        Plane::from_vec(width, height, values).into_python()
    };
    Ok(FlowField {
        u: part(0)?,
        v: part(1)?,
    })
}

fn flow_array<'py>(py: Python<'py>, flow: &FlowField) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let (width, height) = flow.size();
    let pairs = flow.u.data().iter().zip(flow.v.data());
    let data: Vec<f32> = pairs.flat_map(|(u, v)| [*u, *v]).collect();
    PyArray1::from_vec(py, data).reshape([height, width, 2])
}

/// Optical flow by Horn and Schunck's method: least squares with a smoothness prior.
///
/// Parameters
/// ----------
/// image0, image1 : array_like, (H, W)
///     Brightness, of any scale. The motion between them should be below about a pixel, or near
///     `start`.
/// config : sphereflow.config.HornSchunckConfig, optional
///     All settings. The keywords that follow, where given, replace what it says.
/// alpha : float, optional
///     Weight of smoothness, grey levels.
/// solver : {'jacobi', 'sor'}, optional
///     Jacobi's iteration as printed in the thesis, or over-relaxation until converged.
/// sweeps : int, optional
///     Sweeps over the image ('sor': at most).
/// aspect : float, optional
///     Height over width of a pixel.
/// start : array_like, (H, W, 2), optional
///     Flow to start from, pixels.
///
/// Returns
/// -------
/// ndarray of float32, (H, W, 2)
///     Displacement from `image0` to `image1` in pixels: columns to the right, rows down. Unknown pixels
///     (NaN) of the images say nothing, and take their neighbours' flow; NaN everywhere where an
///     image is of one brightness.
///
/// Raises
/// ------
/// ShapeError, DtypeError, ValueRangeError
///     Naming the argument.
#[pyfunction]
#[pyo3(name = "horn_schunck", signature = (image0, image1, *, config = None, alpha = None, solver = None, sweeps = None, aspect = None, start = None))]
#[allow(clippy::too_many_arguments)] // keyword arguments of Python
pub fn py_horn_schunck<'py>(
    py: Python<'py>,
    image0: &Bound<'py, PyAny>,
    image1: &Bound<'py, PyAny>,
    config: Option<&Bound<'py, PyAny>>,
    alpha: Option<f32>,
    solver: Option<&str>,
    sweeps: Option<usize>,
    aspect: Option<f32>,
    start: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let (image0, image1) = (grey(image0, "image0")?, grey(image1, "image1")?);
    let start = start.map(|start| flow_from(start, "start")).transpose()?;
    let mut config: HornSchunckConfig = settings(config)?;
    keywords!(config {
        alpha = alpha,
        aspect = aspect,
    });
    let (kind, its_sweeps, tolerance_px) = parts(&config.solver);
    let kind = solver.map_or(Ok(kind), |word| named::<SolverKind>(word, "solver"))?;
    config.solver = solver_of((kind, sweeps.unwrap_or(its_sweeps), tolerance_px));
    let flow = py.detach(|| horn_schunck(&image0, &image1, &config, start.as_ref()));
    flow_array(py, &flow.into_python()?)
}

/// Optical flow by total variation and an absolute data term, with warps on a pyramid.
///
/// Parameters
/// ----------
/// image0, image1 : array_like, (H, W)
///     Brightness from 1 to 256 (another scale wants another `weight`).
/// config : sphereflow.config.TvL1Config, optional
///     All settings. The keywords that follow, where given, replace what it says.
/// weight : float, optional
///     Weight of the data, per grey level: the thesis's alpha squared. `None`: 0.25 for images without noise,
///     and less, by the noise that is measured.
/// split : float, optional
///     How far the flow that fits the data may lie from the smooth one, 1/(2 beta squared) of the thesis: noise
///     is not fitted. 0 for an absolute data term. `None`: 0.2, and up to 0.4 with noise.
/// warps, iterations, levels : int, optional
///     Linearisations per level, iterations per linearisation, pyramid levels. A video whose flow
///     starts from the one before does with 3, 20 and 1.
/// presmooth_px : float, optional
///     Standard deviation of the Gaussian that smooths both images first. `None`: 0.5, and up to 0.8 with noise.
/// median_radius : int, optional
///     Radius of the median filter of the flow after each linearisation: 0 for none, 1 or 2.
/// start : array_like, (H, W, 2), optional
///     Flow to start from, pixels.
///
/// Returns
/// -------
/// ndarray of float32, (H, W, 2)
///     Displacement from `image0` to `image1` in pixels: columns to the right, rows down. Unknown pixels
///     (NaN) of the images say nothing, and take their neighbours' flow; NaN everywhere where an
///     image is of one brightness.
///
/// Raises
/// ------
/// ShapeError, DtypeError, ValueRangeError
///     Naming the argument.
#[pyfunction]
#[pyo3(name = "tv_l1", signature = (image0, image1, *, config = None, weight = None, split = None, warps = None, iterations = None, levels = None, presmooth_px = None, median_radius = None, start = None))]
#[allow(clippy::too_many_arguments)] // keyword arguments of Python
pub fn py_tv_l1<'py>(
    py: Python<'py>,
    image0: &Bound<'py, PyAny>,
    image1: &Bound<'py, PyAny>,
    config: Option<&Bound<'py, PyAny>>,
    weight: Option<f32>,
    split: Option<f32>,
    warps: Option<usize>,
    iterations: Option<usize>,
    levels: Option<usize>,
    presmooth_px: Option<f32>,
    median_radius: Option<usize>,
    start: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let (image0, image1) = (grey(image0, "image0")?, grey(image1, "image1")?);
    let start = start.map(|start| flow_from(start, "start")).transpose()?;
    if let Some(weight) = weight {
        positive("weight", f64::from(weight)).into_python()?;
    }
    let mut config: TvL1Config = settings(config)?;
    keywords!(config {
        lambda = weight.map(Some),
        split = split.map(Some),
        warps = warps,
        iterations = iterations,
        levels = levels,
        median_radius = median_radius,
        presmooth_px = presmooth_px.map(Some),
    });
    let flow = py.detach(|| tv_l1(&image0, &image1, &config, start.as_ref()));
    flow_array(py, &flow.into_python()?)
}

/// An image without noise, its edges kept (Rudin, Osher and Fatemi, solved by Chambolle's method).
///
/// Parameters
/// ----------
/// image : array_like, (H, W)
///     Brightness.
/// config : sphereflow.config.RofConfig, optional
///     All settings. The keywords that follow, where given, replace what it says.
/// weight : float, optional
///     Weight of the data, per grey level: large keeps the image, small smooths it.
/// iterations : int, optional
///     Iterations.
///
/// Returns
/// -------
/// ndarray of float32, (H, W)
///     The image.
///
/// Raises
/// ------
/// ShapeError, DtypeError, ValueRangeError
///     Naming the argument.
#[pyfunction]
#[pyo3(name = "rof_denoise", signature = (image, *, config = None, weight = None, iterations = None))]
pub fn py_rof_denoise<'py>(
    py: Python<'py>,
    image: &Bound<'py, PyAny>,
    config: Option<&Bound<'py, PyAny>>,
    weight: Option<f32>,
    iterations: Option<usize>,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let image = grey(image, "image")?;
    if let Some(weight) = weight {
        positive("weight", f64::from(weight)).into_python()?;
    }
    let mut config: RofConfig = settings(config)?;
    keywords!(config {
        beta2 = weight,
        iterations = iterations,
    });
    let denoised = py.detach(|| rof_denoise(&image, &config)).into_python()?;
    plane_array(py, denoised)
}
