//! The back: what is done after each keyframe, and once more at the end.

use crate::config::EngineConfig;
use crate::front::distances_of;
use sphereflow_alignment::Aligner;
use sphereflow_core::{Pose, Result, RgbdFrame};
use sphereflow_odometry::OdometryResult;
use sphereflow_slam::{GraphReport, KeyframeClouds, Map};
use sphereflow_solver::StopFlag;
use sphereflow_sphere::Camera;

/// The map with its cloud, and what compares keyframes.
#[derive(Clone, Debug)]
pub struct Back {
    camera: Camera,
    colour_is_registered: bool,
    config: EngineConfig,
    aligner: Aligner,
    map: Map,
    clouds: KeyframeClouds,
    /// Frames that had a pose.
    posed: usize,
}

impl Back {
    /// Of a depth camera; colour goes into the cloud where its pixels are those of the depth image.
    ///
    /// # Errors
    /// A core value error naming the setting that is out of range.
    pub fn new(camera: &Camera, colour_is_registered: bool, config: EngineConfig) -> Result<Self> {
        Ok(Self {
            camera: camera.clone(),
            colour_is_registered,
            aligner: Aligner::new(camera, config.odometry.alignment)?,
            map: Map::default(),
            clouds: KeyframeClouds::new(config.map.cloud)?,
            config,
            posed: 0,
        })
    }

    /// The keyframes, and the frames that hang on them.
    pub fn map(&self) -> &Map {
        &self.map
    }

    /// The coloured cloud.
    pub fn clouds(&self) -> &KeyframeClouds {
        &self.clouds
    }

    /// Keyframes that the frame made, the frame itself, and its surface. The result's keyframes are
    /// taken out of it.
    ///
    /// # Errors
    /// A core shape error where the colour image is not of the camera's size.
    pub fn absorb(&mut self, frame: &RgbdFrame, result: &mut OdometryResult) -> Result<()> {
        for event in result.keyframes.drain(..) {
            self.map.insert(event);
        }
        self.map.hang(result);
        let every = self.config.map.every;
        if result.status.has_pose() {
            self.posed += 1;
        }
        if every == 0 || !result.status.has_pose() || !(self.posed - 1).is_multiple_of(every) {
            return Ok(());
        }
        let (Some((keyframe, pose)), Some(distances)) = (self.map.newest(), distances_of(frame))
        else {
            return Ok(());
        };
        let pose = *pose;
        let colour = frame.colour.as_ref().filter(|_| self.colour_is_registered);
        self.clouds
            .add(keyframe, &pose, &self.camera, distances, colour)?;
        Ok(())
    }

    /// Keyframes compared with each other, their poses fitted, and the cloud at them.
    ///
    /// # Errors
    /// As [`Map::refine`].
    pub fn finish(
        &mut self,
        stop: &StopFlag,
        progress: impl FnMut(usize, usize),
    ) -> Result<Option<GraphReport>> {
        let wanted = self.config.graph.enabled && self.map.keyframes().len() > 1;
        let report = wanted.then(|| {
            self.map.refine(
                &mut self.aligner,
                &self.config.graph,
                &self.config.odometry.keyframes,
                stop,
                progress,
            )
        });
        let report = report.transpose()?;
        self.clouds.united(&self.keyframe_poses())?;
        Ok(report)
    }

    /// The cloud of the keyframes that are followed by others, for looking on.
    pub fn growing_cloud(&mut self) -> &sphereflow_slam::VoxelCloud {
        let poses = self.keyframe_poses();
        self.clouds.grown(&poses)
    }

    fn keyframe_poses(&self) -> Vec<Pose> {
        let keyframes = self.map.keyframes().iter();
        keyframes.map(|node| node.world_from_keyframe).collect()
    }
}
