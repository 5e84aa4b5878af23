//! Settings of the main job.

use super::Settings;
use crate::errors::IntoPython;
use crate::plain::{plain_names, plain_struct};
use pyo3::prelude::*;
use sphereflow_core::checks;
use sphereflow_engine::WorldChoice;
pub use sphereflow_engine::{EngineConfig, MapConfig};
pub use sphereflow_slam::CloudConfig;

plain_names!(WorldChoice { "auto" => Auto, "first-camera" => FirstCamera });
plain_struct!(CloudConfig {
    voxel_m,
    stride,
    max_range_m,
    max_points
});
plain_struct!(MapConfig { every, cloud });
plain_struct!(EngineConfig {
    odometry,
    graph,
    map,
    world
});

impl Settings for CloudConfig {
    const NAME: &'static str = "CloudConfig";

    fn defaults() -> Self {
        Self::default()
    }

    fn check(&self) -> PyResult<()> {
        self.validate().into_python()
    }
}

impl Settings for MapConfig {
    const NAME: &'static str = "MapConfig";

    fn defaults() -> Self {
        Self::default()
    }

    fn check(&self) -> PyResult<()> {
        checks::within("every", self.every, 0..=100_000).into_python()?;
        Settings::check(&self.cloud)
    }
}

impl Settings for EngineConfig {
    const NAME: &'static str = "EngineConfig";

    fn defaults() -> Self {
        Self::default()
    }

    fn check(&self) -> PyResult<()> {
        self.validate().into_python()
    }
}
