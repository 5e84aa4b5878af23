//! Settings of the methods that the odometry is measured against.

use super::Settings;
use crate::errors::IntoPython;
use crate::plain::{plain_names, plain_struct};
use pyo3::prelude::*;
pub use sphereflow_baselines::{RangeFlowConfig, ThesisConfig};
use sphereflow_baselines::{RowWeights, TimeRule};
use sphereflow_sphere::Camera;

plain_struct!(RangeFlowConfig {
    levels,
    block_known_share,
    max_jump,
    sweeps,
    block_noise,
    good_residual_scale,
    max_unexplained_share,
    max_residual_scale,
    min_known_share,
    min_blocks,
    weak_score,
    unobservable_score,
    unobservable_std_m_s,
    max_speed_m_s,
    max_rate_rad_s,
    covariance,
});
plain_names!(TimeRule { "forward" => Forward, "trapezoid" => Trapezoid });
plain_names!(RowWeights { "equal" => Equal, "domain_noise" => DomainNoise });
plain_struct!(ThesisConfig {
    domains,
    overlap,
    time,
    weights,
    min_domains,
    limits
});

impl Settings for RangeFlowConfig {
    const NAME: &'static str = "RangeFlowConfig";

    fn defaults() -> Self {
        Self::default()
    }

    /// Against an image so large that only the settings themselves can be wrong.
    fn check(&self) -> PyResult<()> {
        const LARGE: usize = 1 << 16;
        let camera = Camera::pinhole(1.0, 1.0, 0.0, 0.0, LARGE, LARGE).into_python()?;
        self.validate(&camera).into_python()
    }
}

impl Settings for ThesisConfig {
    const NAME: &'static str = "ThesisConfig";

    fn defaults() -> Self {
        Self::default()
    }

    fn check(&self) -> PyResult<()> {
        self.validate().into_python()
    }
}
