//! Settings of the alignment, the odometry and the self-calibration.

use super::{Settings, without_prefix};
use crate::errors::IntoPython;
use crate::plain::{Plain, dict_of, field, named, plain_names, plain_struct};
use pyo3::prelude::*;
use pyo3::types::PyDict;
pub use sphereflow_alignment::{Config, CovarianceModel, Method, NoiseModel};
pub use sphereflow_calibration::SelfCalibrationConfig;
pub use sphereflow_odometry::{KeyframePolicy, OdometryConfig};
pub use sphereflow_slam::GraphConfig;

plain_names!(Method { "pyramid" => Pyramid, "single" => Single });
plain_struct!(CovarianceModel {
    scale,
    floor_m,
    motion_share
});
plain_struct!(Config {
    block,
    levels,
    coarse_solves,
    warps,
    block_known_share,
    max_jump,
    max_bend,
    domains,
    domain_known_share,
    sweeps,
    domain_noise,
    noise,
    good_residual_scale,
    max_unexplained_share,
    max_residual_scale,
    max_divided_share,
    min_known_share,
    min_domains,
    weak_score,
    unobservable_score,
    max_std_m,
    unobservable_std_m_s,
    max_speed_m_s,
    max_rate_rad_s,
    max_gap_s,
    brightness_weight,
    covariance,
});
plain_struct!(KeyframePolicy {
    enabled,
    min_overlap,
    max_flow_px,
    least_overlap,
    max_surprise_m
});
plain_struct!(GraphConfig {
    enabled,
    max_angle_rad,
    max_distance_m,
    min_overlap,
    max_edges,
    floor_m,
    floor_rad,
    rounds,
});
plain_struct!(OdometryConfig { alignment, keyframes, readout_s } skip { emit_keyframes });
plain_struct!(SelfCalibrationConfig {
    lens,
    field,
    readout,
    readout_s,
    iterations,
    block,
    domains,
    max_pairs,
    min_pairs,
    min_gap,
    max_gap,
    min_motion_m,
    max_turn_rad,
    max_distance_m,
    lens_std,
    focal_std,
    field_std,
    readout_std_s,
    observable_share,
    least_noise,
});

/// Which noise it is; the numbers are those of a time-of-flight camera, and unused for the other.
#[derive(Clone, Copy, PartialEq)]
enum NoiseKind {
    Disparity,
    TimeOfFlight,
}
plain_names!(NoiseKind { "disparity" => Disparity, "time_of_flight" => TimeOfFlight });

/// The noise of a word, with the common numbers.
pub fn noise_named(word: &str) -> PyResult<NoiseModel> {
    Ok(match named::<NoiseKind>(word, "noise")? {
        NoiseKind::Disparity => NoiseModel::Disparity,
        NoiseKind::TimeOfFlight => NoiseModel::time_of_flight(),
    })
}

impl Plain for NoiseModel {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let kind = match self {
            Self::Disparity => NoiseKind::Disparity,
            Self::TimeOfFlight { .. } => NoiseKind::TimeOfFlight,
        };
        let dict = PyDict::new(py);
        dict.set_item("model", kind.to_plain(py)?)?;
        let numbers = match self {
            Self::Disparity => Self::time_of_flight(),
            Self::TimeOfFlight { .. } => *self,
        };
        if let Self::TimeOfFlight { floor_m, share } = numbers {
            dict.set_item("floor_m", floor_m)?;
            dict.set_item("share", share)?;
        }
        Ok(dict.into_any())
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let dict = dict_of(value)?;
        let (floor_m, share) = (field(dict, "floor_m")?, field(dict, "share")?);
        let flight = Self::TimeOfFlight { floor_m, share };
        // Numbers that are not used must make sense too: they may be tomorrow.
        flight
            .validate()
            .map_err(|error| without_prefix(&error, "noise."))?;
        Ok(match field::<NoiseKind>(dict, "model")? {
            NoiseKind::Disparity => Self::Disparity,
            NoiseKind::TimeOfFlight => flight,
        })
    }
}

impl Settings for NoiseModel {
    const NAME: &'static str = "NoiseConfig";

    fn defaults() -> Self {
        Self::default()
    }

    fn check(&self) -> PyResult<()> {
        Ok(()) // checked where it is read
    }
}

impl Settings for CovarianceModel {
    const NAME: &'static str = "CovarianceConfig";

    fn defaults() -> Self {
        Self::default()
    }

    fn check(&self) -> PyResult<()> {
        let config = Config {
            covariance: *self,
            ..Config::default()
        };
        config
            .validate()
            .map_err(|error| without_prefix(&error, "covariance."))
    }
}

/// Settings whose checks are a method.
macro_rules! checked {
    ($($type:ident as $name:literal),+ $(,)?) => {$(
        impl Settings for $type {
            const NAME: &'static str = $name;

            fn defaults() -> Self {
                Self::default()
            }

            fn check(&self) -> PyResult<()> {
                self.validate().into_python()
            }
        }
    )+};
}
checked!(
    Config as "AlignmentConfig",
    KeyframePolicy as "KeyframeConfig",
    GraphConfig as "GraphConfig",
    OdometryConfig as "OdometryConfig",
    SelfCalibrationConfig as "SelfCalibrationConfig",
);
