//! Scene, camera, motion and sensors together: a recording that never happened.

mod config;
mod frames;
mod presets;
mod recording;

pub use config::{DepthNoiseParameters, MagConfig, SimConfig};
pub use frames::{Frames, SimulatedFrame};

use crate::noise::{DepthNoise, ImageNoise, RollingShutter};
use crate::sensors::{Imu, MagneticField, Magnetometer};
use crate::{MotionState, Rendered, Renderer, Result};
use sphereflow_core::{Stamp, Trajectory};

/// A checked [`SimConfig`] with everything that does not depend on time made ready. Its frames can
/// be drawn any number of times and are the same each time, with any number of threads.
#[derive(Clone, Debug)]
pub struct Simulator {
    config: SimConfig,
    renderer: Renderer,
    depth_noise: DepthNoise,
    image_noise: ImageNoise,
    shutter: RollingShutter,
    imu: Option<Imu>,
    mag: Option<(MagneticField, Magnetometer)>,
    frame_count: usize,
}

impl Simulator {
    /// Check a configuration and make it ready.
    ///
    /// # Errors
    /// A value error naming the setting that is out of range, or the noise that does not fit the
    /// camera.
    pub fn new(config: SimConfig) -> Result<Self> {
        let frame_count = config.check()?;
        let shutter = RollingShutter::new(config.readout_s, config.camera.height())?;
        let mut image = config.image_noise;
        image.rolling_shutter = (config.readout_s != 0.0).then_some(shutter);
        let mag = match &config.mag {
            Some(mag) => Some((
                MagneticField::new(&mag.field, config.seed)?,
                Magnetometer::new(mag.sensor, config.seed)?,
            )),
            None => None,
        };
        Ok(Self {
            renderer: Renderer::new(&config.scene, &config.camera),
            depth_noise: config.depth_noise.model(&config.camera, config.seed)?,
            image_noise: ImageNoise::new(image, config.seed)?,
            shutter,
            imu: match config.imu {
                Some(parameters) => Some(Imu::new(parameters, config.seed)?),
                None => None,
            },
            mag,
            frame_count,
            config,
        })
    }

    /// The configuration.
    pub fn config(&self) -> &SimConfig {
        &self.config
    }

    /// The scene and the camera's rays.
    pub fn renderer(&self) -> &Renderer {
        &self.renderer
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.frame_count
    }

    /// True without frames: never, a configuration without frames is an error.
    pub fn is_empty(&self) -> bool {
        self.frame_count == 0
    }

    /// Stamp of frame `index`: `index / rate_hz` after the start, rounded to the nanosecond. With a
    /// rolling shutter it is the exposure of the middle row.
    pub fn stamp(&self, index: usize) -> Stamp {
        let after_s = index as f64 / self.config.rate_hz;
        self.config.start.plus_seconds(after_s)
    }

    /// How the camera moves at a stamp.
    pub fn state(&self, stamp: Stamp) -> MotionState {
        let t_s = stamp.seconds_since(self.config.start);
        self.config.motion.state(t_s)
    }

    /// The true poses, `world_from_camera`, one a frame.
    ///
    /// # Errors
    /// A time-order error where the rate is beyond a frame a nanosecond.
    pub fn truth(&self) -> Result<Trajectory> {
        let mut truth = Trajectory::new();
        for stamp in (0..self.frame_count).map(|index| self.stamp(index)) {
            truth.push(stamp, self.state(stamp).world_from_camera)?;
        }
        Ok(truth)
    }

    /// The image at a stamp without noise; each row at its own time where the shutter rolls.
    pub fn exact(&self, stamp: Stamp) -> Rendered {
        if self.config.readout_s == 0.0 {
            return self.renderer.render(&self.state(stamp).world_from_camera);
        }
        let t_s = stamp.seconds_since(self.config.start);
        let row_pose = |y| self.config.motion.pose(t_s + self.shutter.row_time_s(y));
        self.renderer.render_at(row_pose)
    }

    /// The frames in order, drawn as they are asked for.
    pub fn frames(&self) -> Frames<'_> {
        Frames::new(self)
    }
}
