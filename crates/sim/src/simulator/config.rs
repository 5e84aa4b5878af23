//! What is to be simulated, and the check of its numbers.

use crate::noise::{
    DepthNoise, ImageNoiseParameters, IndependentNoise, KinectNoise, KinectParameters,
};
use crate::sensors::{ImuParameters, MagneticFieldParameters, MagnetometerParameters};
use crate::{Error, Motion, Result, Scene};
use nalgebra::Vector3;
use sphereflow_core::{DepthMap, Plane, Stamp};
use sphereflow_sphere::Camera;

/// More frames than this are taken for a mistake in the rate or the duration.
const MOST_FRAMES: f64 = 1e7;

/// Places of the path that are checked.
const PATH_CHECKS: u32 = 2000;

/// Everything a simulation depends on. Every fault can be switched off by itself.
#[derive(Clone, Debug, PartialEq)]
pub struct SimConfig {
    /// The world.
    pub scene: Scene,
    /// The camera of depth and colour.
    pub camera: Camera,
    /// How it moves.
    pub motion: Motion,
    /// Length of the recording, seconds.
    pub duration_s: f64,
    /// Frames per second: `duration_s * rate_hz` frames, the first at the start.
    pub rate_hz: f64,
    /// Decides all noise; the scene and the motion have seeds of their own.
    pub seed: u64,
    /// Stamp of the first frame, at time 0 of the motion.
    pub start: Stamp,
    /// What the depth camera adds.
    pub depth_noise: DepthNoiseParameters,
    /// What the colour camera adds; its `rolling_shutter` is set from `readout_s`.
    pub image_noise: ImageNoiseParameters,
    /// Rolling shutter: seconds from the first row to the end of the last; 0 for a global shutter.
    pub readout_s: f64,
    /// The inertial sensor, if any.
    pub imu: Option<ImuParameters>,
    /// The magnetometer, if any.
    pub mag: Option<MagConfig>,
}

/// Noise of the depth camera, seeded by the configuration.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum DepthNoiseParameters {
    /// Perfect depth.
    #[default]
    None,
    /// Each pixel for itself: standard deviation and step of 1/Z, 1/m.
    Independent {
        /// Standard deviation of 1/Z, 1/m.
        sigma_inv_m: f64,
        /// Step of 1/Z, 1/m; 0 for none.
        quantum_inv_m: f64,
    },
    /// Structured light with all its faults.
    Kinect(KinectParameters),
}

/// The magnetic field of the room and the sensor in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagConfig {
    /// The field.
    pub field: MagneticFieldParameters,
    /// The sensor.
    pub sensor: MagnetometerParameters,
    /// Readings per second.
    pub rate_hz: f64,
}

impl Default for MagConfig {
    /// A room in central Europe with six pieces of iron, and a telephone's sensor in it: 50 Hz,
    /// 0.4 uT of noise, not calibrated for the iron of the telephone itself.
    fn default() -> Self {
        Self {
            field: MagneticFieldParameters::default(),
            sensor: MagnetometerParameters {
                hard_iron_ut: Vector3::new(5.0, -3.0, 8.0),
                sigma_ut: 0.4,
                ..MagnetometerParameters::default()
            },
            rate_hz: 50.0,
        }
    }
}

impl DepthNoiseParameters {
    /// The noise itself, tried on the camera.
    pub(super) fn model(&self, camera: &Camera, seed: u64) -> Result<DepthNoise> {
        let noise = match self {
            Self::None => DepthNoise::None,
            Self::Independent {
                sigma_inv_m,
                quantum_inv_m,
            } => {
                DepthNoise::Independent(IndependentNoise::new(*sigma_inv_m, *quantum_inv_m, seed)?)
            }
            Self::Kinect(parameters) => {
                DepthNoise::Kinect(KinectNoise::new(parameters.clone(), seed)?)
            }
        };
        let unknown = Plane::filled(camera.width(), camera.height(), f32::NAN);
        noise.apply(&DepthMap::new(unknown), camera, 0)?;
        Ok(noise)
    }
}

impl SimConfig {
    /// A perfect camera in a scene: no noise, a global shutter, no inertial sensors, starting at
    /// stamp 0, for the duration the motion is meant for, at 30 Hz.
    pub fn perfect(scene: Scene, camera: Camera, motion: Motion) -> Self {
        Self {
            scene,
            camera,
            duration_s: motion.duration_s,
            motion,
            rate_hz: 30.0,
            seed: 0,
            start: Stamp::default(),
            depth_noise: DepthNoiseParameters::None,
            image_noise: ImageNoiseParameters::default(),
            readout_s: 0.0,
            imu: None,
            mag: None,
        }
    }

    /// The number of frames, where the numbers make sense.
    pub(super) fn check(&self) -> Result<usize> {
        positive("duration_s", self.duration_s, "seconds")?;
        positive("rate_hz", self.rate_hz, "hertz")?;
        // A duration of 0.1 s at 30 Hz is 3 frames, whatever the rounding of 0.1.
        let frames = (self.duration_s * self.rate_hz + 1e-6).floor();
        if !(1.0..=MOST_FRAMES).contains(&frames) {
            let expected = format!("1 to {MOST_FRAMES} frames at {} Hz", self.rate_hz);
            return Err(Error::value("duration_s", expected, self.duration_s));
        }
        if self.readout_s.is_nan() || self.readout_s.abs() > 1.0 / self.rate_hz {
            let expected = format!("at most the {} s between frames", 1.0 / self.rate_hz);
            return Err(Error::value("readout_s", expected, self.readout_s));
        }
        if let Some(mag) = &self.mag {
            positive("mag.rate_hz", mag.rate_hz, "hertz")?;
        }
        self.check_path()?;
        Ok(frames as usize)
    }

    /// The path must be finite and lead through free space: from inside a cupboard the images would
    /// look as if it were not there.
    fn check_path(&self) -> Result<()> {
        for step in 0..=PATH_CHECKS {
            let t_s = self.duration_s * f64::from(step) / f64::from(PATH_CHECKS);
            let state = self.motion.state(t_s);
            let place = state.world_from_camera.translation;
            let turn = state.world_from_camera.quat_xyzw();
            let finite = place.iter().chain(&turn).all(|v| v.is_finite());
            let found = format!("({}, {}, {}) m at {t_s} s", place.x, place.y, place.z);
            if !finite {
                return Err(Error::value("motion", "finite poses", found));
            }
            if let Some(primitive) = self.scene.obstacle(&place) {
                let found = format!("{found}, beyond the surface of primitive {primitive}");
                return Err(Error::value("motion", "a path through free space", found));
            }
        }
        Ok(())
    }
}

fn positive(argument: &str, value: f64, unit: &str) -> Result<()> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Error::value(argument, format!("positive {unit}"), value))
}
