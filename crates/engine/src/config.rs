//! The settings of the main job.

use sphereflow_core::{Result, checks};
use sphereflow_odometry::OdometryConfig;
use sphereflow_slam::{CloudConfig, GraphConfig};

/// Which axes the world has; its origin is the first camera in any case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WorldChoice {
    /// y along gravity where it is known where the inertial sensor sits and the camera is calm
    /// enough before its first frame; otherwise the axes of the first camera.
    #[default]
    Auto,
    /// The axes of the first camera.
    FirstCamera,
}

/// How the cloud is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapConfig {
    /// Frames per frame that is put into the cloud: neighbours see the same surface, a third of them
    /// suffices. 0: no cloud.
    pub every: usize,
    /// Voxels and ranges.
    pub cloud: CloudConfig,
}

impl Default for MapConfig {
    fn default() -> Self {
        Self {
            every: 3,
            cloud: CloudConfig::default(),
        }
    }
}

/// Settings of [`crate::Engine`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EngineConfig {
    /// Frames against keyframes. Its read-out time is that of the calibration, where that has one.
    pub odometry: OdometryConfig,
    /// Keyframes against each other.
    pub graph: GraphConfig,
    /// The cloud.
    pub map: MapConfig,
    /// The world's axes.
    pub world: WorldChoice,
}

impl EngineConfig {
    /// Checks every setting.
    ///
    /// # Errors
    /// A core value error naming the first setting out of its range.
    pub fn validate(&self) -> Result<()> {
        self.odometry.validate()?;
        self.graph.validate()?;
        checks::within("every", self.map.every, 0..=100_000)?;
        self.map.cloud.validate()
    }
}
