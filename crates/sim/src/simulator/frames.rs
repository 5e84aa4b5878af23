//! The stream of frames, each with its truth.

use super::Simulator;
use crate::noise::NoiseWorkspace;
use crate::sensors::{BodyMotion, Imu, ImuBias, Magnetometer};
use crate::{MotionState, Rendered, Result};
use sphereflow_core::{DepthMap, ImuSample, MagSample, Plane, RangeMap, RgbdFrame, Stamp};

/// What the sensors say of one instant, and the truth beside it.
#[derive(Clone, Debug)]
pub struct SimulatedFrame {
    /// What an estimator may see.
    pub frame: RgbdFrame,
    /// How the camera moves at the frame's stamp.
    pub state: MotionState,
    /// The images without noise: range, depth, colour and unquantised brightness.
    pub exact: Rendered,
    /// Bias of the last inertial sample so far; `None` without an inertial sensor.
    pub imu_bias: Option<ImuBias>,
}

/// Iterator over the frames of a [`Simulator`]. After an error it ends.
#[derive(Debug)]
pub struct Frames<'a> {
    simulator: &'a Simulator,
    workspace: NoiseWorkspace,
    next: usize,
    imu: Option<Imu>,
    imu_next: usize,
    imu_bias: Option<ImuBias>,
    mag: Option<Magnetometer>,
    mag_next: usize,
}

impl<'a> Frames<'a> {
    pub(super) fn new(simulator: &'a Simulator) -> Self {
        Self {
            simulator,
            workspace: NoiseWorkspace::default(),
            next: 0,
            imu: simulator.imu.clone(),
            imu_next: 0,
            imu_bias: None,
            mag: simulator.mag.as_ref().map(|(_, sensor)| sensor.clone()),
            mag_next: 0,
        }
    }

    fn draw(&mut self, index: usize) -> Result<SimulatedFrame> {
        let simulator = self.simulator;
        let stamp = simulator.stamp(index);
        let exact = simulator.exact(stamp);
        let (metres, colour) = self.corrupt(&exact, stamp, index as u64)?;
        let (depth, range) = if simulator.config.camera.wraps_around() {
            (None, Some(RangeMap::new(metres)))
        } else {
            (Some(DepthMap::new(metres)), None)
        };
        let frame = RgbdFrame {
            stamp,
            colour: Some(colour),
            depth,
            range,
            imu: self.imu_until(stamp)?,
            mag: self.mag_until(stamp)?,
            ..RgbdFrame::default()
        };
        Ok(SimulatedFrame {
            frame,
            state: simulator.state(stamp),
            exact,
            imu_bias: self.imu_bias,
        })
    }

    /// What the cameras make of the exact images: depth (range, where the camera sees all around)
    /// in metres, and colour. The two noises run beside each other: parts of
    /// each are bound to one thread.
    fn corrupt(
        &mut self,
        exact: &Rendered,
        stamp: Stamp,
        index: u64,
    ) -> Result<(Plane<f32>, Plane<[u8; 3]>)> {
        let (simulator, workspace) = (self.simulator, &mut self.workspace);
        let camera = &simulator.config.camera;
        let noisy_metres = || -> Result<Plane<f32>> {
            let mut depth = if camera.wraps_around() {
                // The noise of a range is that of a depth: in the inverse of the distance.
                DepthMap::new(exact.range.metres().clone())
            } else {
                exact.depth.clone()
            };
            let noise = &simulator.depth_noise;
            noise.apply_in_place(&mut depth, camera, index, workspace)?;
            Ok(depth.into_plane())
        };
        let noisy_colour = || {
            let mut colour = exact.colour.clone();
            simulator.image_noise.apply_rgb(&mut colour, stamp, index);
            colour
        };
        let (metres, colour) = rayon::join(noisy_metres, noisy_colour);
        Ok((metres?, colour))
    }

    /// The inertial samples that have not been given, up to a stamp.
    fn imu_until(&mut self, until: Stamp) -> Result<Vec<ImuSample>> {
        let mut samples = Vec::new();
        let Some(imu) = &mut self.imu else {
            return Ok(samples);
        };
        let rate_hz = imu.parameters().rate_hz;
        loop {
            let stamp = nth(self.simulator.config.start, self.imu_next, rate_hz);
            if stamp > until {
                return Ok(samples);
            }
            let reading = imu.sample(stamp, &body_motion(&self.simulator.state(stamp)))?;
            self.imu_bias = Some(reading.bias);
            samples.push(reading.sample);
            self.imu_next += 1;
        }
    }

    /// The magnetic samples that have not been given, up to a stamp.
    fn mag_until(&mut self, until: Stamp) -> Result<Vec<MagSample>> {
        let mut samples = Vec::new();
        let (config, field) = (&self.simulator.config, &self.simulator.mag);
        let (Some(sensor), Some((field, _)), Some(mag)) = (&mut self.mag, field, &config.mag)
        else {
            return Ok(samples);
        };
        loop {
            let stamp = nth(config.start, self.mag_next, mag.rate_hz);
            if stamp > until {
                return Ok(samples);
            }
            let pose = self.simulator.state(stamp).world_from_camera;
            samples.push(sensor.sample(stamp, field, &pose)?);
            self.mag_next += 1;
        }
    }
}

impl Simulator {
    /// All inertial and magnetic samples up to the last frame, the same that the frames carry,
    /// without drawing any image.
    ///
    /// # Errors
    /// Those of the sensors.
    pub fn inertial(&self) -> Result<(Vec<ImuSample>, Vec<MagSample>)> {
        let mut frames = Frames::new(self);
        let last = self.stamp(self.len().saturating_sub(1));
        Ok((frames.imu_until(last)?, frames.mag_until(last)?))
    }
}

/// Stamp of reading `index` of a sensor.
fn nth(start: Stamp, index: usize, rate_hz: f64) -> Stamp {
    start.plus_seconds(index as f64 / rate_hz)
}

fn body_motion(state: &MotionState) -> BodyMotion {
    BodyMotion {
        world_from_camera: state.world_from_camera.rotation,
        omega_body: state.twist.angular_rad_s,
        alpha_body: state.angular_accel_rad_s2,
        accel_world: state.accel_world_m_s2,
    }
}

impl Iterator for Frames<'_> {
    type Item = Result<SimulatedFrame>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.next >= self.simulator.len() {
            return None;
        }
        let frame = self.draw(self.next);
        self.next = if frame.is_ok() {
            self.next + 1
        } else {
            self.simulator.len()
        };
        Some(frame)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.simulator.len() - self.next;
        (left.min(1), Some(left))
    }
}
