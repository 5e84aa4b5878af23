//! Arguments and results that the estimators of motion share.

use crate::arrays::{floats, metres};
use crate::config::{keywords, noise_named};
use crate::errors::{Kind, exception};
use crate::plain::named;
use nalgebra::{Matrix6, Vector3};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use sphereflow_alignment::{Config, DepthImage, Method};
use sphereflow_core::{DepthMap, RangeMap, TrackStatus};

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

/// Settings of the alignment with the keywords that were given.
pub fn with_keywords(
    mut config: Config,
    method: Option<&str>,
    domains: Option<usize>,
    max_std_m: Option<f64>,
    noise: Option<&str>,
) -> PyResult<Config> {
    if let Some(method) = method {
        let of_method = Config::of(named::<Method>(method, "method")?);
        (config.block, config.levels) = (of_method.block, of_method.levels);
    }
    let noise = noise.map(noise_named).transpose()?;
    keywords!(config {
        domains = domains,
        max_std_m = max_std_m,
        noise = noise,
    });
    Ok(config)
}

/// Three finite numbers.
pub fn vector3_of(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Vector3<f64>> {
    let array = floats(value, name, &[Some(3)])?;
    let vector = Vector3::from_column_slice(array.as_slice()?);
    if vector.iter().all(|v| v.is_finite()) {
        return Ok(vector);
    }
    let found = vector.as_slice();
    let text = format!("{name}: expected three finite numbers, found {found:?}");
    Err(exception(Kind::Value, text))
}

/// A standard deviation: positive and finite, or zero where `or_zero`.
pub fn deviation(value: f64, name: &str, or_zero: bool) -> PyResult<f64> {
    if value.is_finite() && (value > 0.0 || (or_zero && value == 0.0)) {
        return Ok(value);
    }
    let least = if or_zero { "not negative" } else { "positive" };
    let text = format!("{name}: expected a standard deviation that is {least}, found {value}");
    Err(exception(Kind::Value, text))
}
