//! The engine as users hold it: push samples, read updates, finish.

use crate::back::Back;
use crate::config::EngineConfig;
use crate::front::Front;
use crate::report::Report;
use crate::update::Update;
use crate::world::{self, World};
use sphereflow_core::{ImuSample, Result, RgbdFrame, Sample, Trajectory};
use sphereflow_odometry::OdometryResult;
use sphereflow_slam::{GraphReport, Map, VoxelCloud};
use sphereflow_solver::StopFlag;
use sphereflow_sphere::Calibration;

/// Which poses of a run: see [`Engine::trajectory`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// As the map has them now: after [`Engine::finish`] the best there are.
    Final,
    /// As they were published while running, never touched again.
    Causal,
}

/// Inertial readings kept before the first frame.
const READINGS_KEPT: usize = 4096;

/// The main job, one stage after the other.
#[derive(Clone, Debug)]
pub struct Engine {
    calibration: Calibration,
    config: EngineConfig,
    front: Front,
    back: Back,
    report: Report,
    /// Inertial readings up to the first frame, which find the world's axes.
    readings: Vec<ImuSample>,
    started: bool,
    causal: Trajectory,
    stop: StopFlag,
}

impl Engine {
    /// For the device that `calibration` describes.
    ///
    /// # Errors
    /// A core value error where the calibration has no depth camera, or names the setting or entry
    /// that is out of range.
    pub fn new(calibration: Calibration, config: EngineConfig) -> Result<Self> {
        calibration.check()?;
        config.validate()?;
        let front = Front::new(&calibration, config.odometry)?;
        let back = Back::new(front.camera(), calibration.is_registered(), config)?;
        Ok(Self {
            front,
            back,
            report: Report::new(not_begun()),
            readings: Vec::new(),
            started: false,
            causal: Trajectory::new(),
            stop: StopFlag::new(),
            calibration,
            config,
        })
    }

    /// The next sample; what became of it, where it is a frame.
    ///
    /// # Errors
    /// A core shape error where an image is not of the camera's size; the engine is as before.
    pub fn push(&mut self, sample: impl Into<Sample>) -> Result<Option<Update>> {
        match sample.into() {
            Sample::Frame(frame) => self.push_frame(frame).map(Some),
            Sample::Imu(batch) => {
                self.read(&batch.samples);
                Ok(None)
            }
            Sample::Mag(_) => Ok(None), // no stage of the main job takes it yet
        }
    }

    /// After the last frame: keyframes compared with each other, all poses fitted, the cloud at them.
    /// What the graph did, `None` where there was nothing to compare. Frames may be pushed after it.
    ///
    /// # Errors
    /// As [`Map::refine`].
    pub fn finish(&mut self) -> Result<Option<GraphReport>> {
        self.finish_with(|_, _| {})
    }

    /// The same, telling how many comparisons of how many are done.
    ///
    /// # Errors
    /// As [`Engine::finish`].
    pub fn finish_with(
        &mut self,
        progress: impl FnMut(usize, usize),
    ) -> Result<Option<GraphReport>> {
        self.report.graph = self.back.finish(&self.stop, progress)?;
        if let Some(keyframe) = self.back.map().keyframes().last() {
            self.front.rebase(&keyframe.world_from_keyframe);
        }
        Ok(self.report.graph)
    }

    /// Forgets everything but calibration and settings.
    ///
    /// # Errors
    /// None in practice: both were accepted before.
    pub fn reset(&mut self) -> Result<()> {
        *self = Self::new(self.calibration.clone(), self.config)?;
        Ok(())
    }

    /// Ends [`Engine::finish`] after the comparison under way; the poses are whole. For another
    /// thread: see [`Engine::stop_flag`].
    pub fn cancel(&self) {
        self.stop.raise();
    }

    /// The flag that [`Engine::cancel`] raises.
    pub fn stop_flag(&self) -> StopFlag {
        self.stop.clone()
    }

    /// Poses of all frames that have one; [`Kind::Causal`] as [`Update`]s had them.
    ///
    /// # Errors
    /// None in practice: stamps of accepted frames increase.
    pub fn trajectory(&self, kind: Kind) -> Result<Trajectory> {
        match kind {
            Kind::Final => self.back.map().trajectory(),
            Kind::Causal => Ok(self.causal.clone()),
        }
    }

    /// The keyframes, and the frames that hang on them.
    pub fn map(&self) -> &Map {
        self.back.map()
    }

    /// The coloured cloud as it was last put together: by [`Engine::finish`] or
    /// [`Engine::growing_cloud`].
    pub fn cloud(&self) -> &VoxelCloud {
        self.back.clouds().whole()
    }

    /// The cloud of the keyframes that are followed by others, for looking on while it grows.
    pub fn growing_cloud(&mut self) -> &VoxelCloud {
        self.back.growing_cloud()
    }

    /// What is known of the device.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// The settings.
    pub fn config(&self) -> &EngineConfig {
        &self.config
    }

    /// The numbers of the run so far.
    pub fn report(&self) -> &Report {
        &self.report
    }

    fn push_frame(&mut self, mut frame: RgbdFrame) -> Result<Update> {
        self.front.prepared(&mut frame)?;
        self.read(&frame.imu);
        self.begin();
        let mut result = self.front.track(&frame)?;
        let is_keyframe = !result.keyframes.is_empty();
        self.back.absorb(&frame, &mut result)?;
        let update = self.update(&result, is_keyframe);
        self.report
            .note(update.stamp, &update.status, update.segment);
        self.report.keyframes = self.front.odometry().keyframe_count();
        if update.status.has_pose() {
            self.causal.push(update.stamp, update.world_from_camera)?;
        }
        Ok(update)
    }

    fn update(&mut self, result: &OdometryResult, is_keyframe: bool) -> Update {
        let motion = result.keyframe_motion.as_ref();
        let measured = motion.map(|motion| self.back.map().covariance_of(motion));
        let estimate = result.estimate.as_ref();
        Update {
            stamp: result.stamp,
            world_from_camera: result.world_from_camera,
            covariance: self.front.covariance(result, measured),
            status: result.status,
            quality: estimate.map_or(f64::NAN, |estimate| estimate.score),
            segment: result.segment,
            is_keyframe,
            epoch: self.back.map().epoch(),
            twist: result.twist,
            timings: result.timings,
        }
    }

    /// Keeps inertial readings for the world's axes.
    fn read(&mut self, readings: &[ImuSample]) {
        if !self.started {
            self.readings.extend_from_slice(readings);
            let surplus = self.readings.len().saturating_sub(READINGS_KEPT);
            self.readings.drain(..surplus);
        }
    }

    /// At the first frame: the world's axes.
    fn begin(&mut self) {
        if self.started {
            return;
        }
        let extrinsics = self.calibration.camera_from_imu.as_ref();
        let (world, pose) = world::found(self.config.world, extrinsics, &self.readings);
        self.front.begin_at(pose);
        self.report.world = world;
        self.readings = Vec::new();
        self.started = true;
    }
}

fn not_begun() -> World {
    World::FirstCamera {
        because: "no frame yet".into(),
    }
}
