//! Settings: the frozen dataclasses of `sphereflow.config` and the Rust structs that they stand for.

mod alignment;
mod baselines;
mod depth;
mod engine;
mod flow;
mod observers;

pub use alignment::noise_named;
pub use depth::{DepthObserverConfig, FlowObserverConfig};
pub use flow::{SolverKind, parts, solver};

use crate::errors::{Kind, exception};
use crate::plain::Plain;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Settings with a dataclass of the same fields.
pub trait Settings: Plain {
    /// Name of the dataclass.
    const NAME: &'static str;

    /// The defaults.
    fn defaults() -> Self;

    /// The exception that names the first setting out of its range.
    fn check(&self) -> PyResult<()>;
}

/// The settings of a dataclass that was given, or the defaults.
pub fn settings<T: Settings>(config: Option<&Bound<'_, PyAny>>) -> PyResult<T> {
    let Some(config) = config else {
        return Ok(T::defaults());
    };
    let class = config.get_type().name()?.to_string();
    if class != T::NAME {
        let expected = format!("expected a sphereflow.config.{}", T::NAME);
        let text = format!("config: {expected}, found {class}");
        return Err(exception(Kind::Dtype, text));
    }
    T::from_plain(&config.call_method0("as_dict")?)
}

/// Sets those fields of `$config` whose keyword was given.
macro_rules! keywords {
    ($config:ident { $($($field:ident).+ = $value:expr),+ $(,)? }) => {
        $(if let Some(value) = $value {
            $config.$($field).+ = value;
        })+
    };
}
pub(crate) use keywords;

/// Calls `$call!(type)` for the settings of that name.
macro_rules! of_name {
    ($name:expr, $call:ident) => {
        of_name!($name, $call, alignment::{
            Config, CovarianceModel, NoiseModel, KeyframePolicy, GraphConfig, OdometryConfig,
            SelfCalibrationConfig
        }, baselines::{RangeFlowConfig, ThesisConfig},
        depth::{
            DepthFilterConfig, FlowObserverConfig, DepthObserverConfig, SobolevConfig, TvDepthConfig
        }, engine::{CloudConfig, MapConfig, EngineConfig}, flow::{HornSchunckConfig, TvL1Config, RofConfig},
        observers::{
            AttitudeConfig, ImuBiasConfig, ObserverGains, VelocityBiasConfig, FixedGains,
            NavigationConfig
        })
    };
    ($name:expr, $call:ident, $($module:ident::{$($type:ident),+}),+) => {
        match $name {
            $($(name if name == <$module::$type as Settings>::NAME => $call!($module::$type),)+)+
            other => {
                let text = format!("name: expected that of a config class, found '{other}'");
                Err(exception(Kind::Value, text))
            }
        }
    };
}

/// The defaults of a class of `sphereflow.config` as a dict. Private.
#[pyfunction]
#[pyo3(name = "_default_config")]
pub fn default_config<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    macro_rules! defaults {
        ($type:ty) => {
            <$type as Settings>::defaults().to_plain(py)
        };
    }
    of_name!(name, defaults)
}

/// Raises where a setting of a class of `sphereflow.config` is out of its range. Private.
#[pyfunction]
#[pyo3(name = "_check_config")]
pub fn check_config(name: &str, values: &Bound<'_, PyDict>) -> PyResult<()> {
    macro_rules! check {
        ($type:ty) => {
            Settings::check(&<$type as Plain>::from_plain(values.as_any())?)
        };
    }
    of_name!(name, check)
}

/// The exception of a core error whose argument loses its first word: `noise.share` is the `share`
/// of the noise alone.
fn without_prefix(error: &sphereflow_core::Error, prefix: &str) -> PyErr {
    let mut error = error.clone();
    if let sphereflow_core::Error::Value { argument, .. } = &mut error
        && let Some(rest) = argument.strip_prefix(prefix)
    {
        *argument = rest.to_string();
    }
    crate::errors::core_error(&error)
}
