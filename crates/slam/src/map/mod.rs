//! The map: keyframes with their graph, and the frames that hang on them.
//!
//! A frame's pose is its keyframe's times its pose in the keyframe: where a keyframe moves, all its
//! frames move with it, and no pose is kept twice.

pub mod covariance;
pub(crate) mod keyframe;
pub(crate) mod keyframe_graph;

use crate::loops::dense_edges;
pub use keyframe::Keyframe;
pub use keyframe_graph::{Edge, GraphReport};

use crate::config::GraphConfig;
use nalgebra::Matrix6;
use sphereflow_alignment::Aligner;
use sphereflow_core::{Pose, Reason, Result, Stamp, TrackStatus, Trajectory};
use sphereflow_odometry::{KeyframeEvent, KeyframeMotion, KeyframePolicy, OdometryResult};
use sphereflow_solver::StopFlag;

/// A frame with a pose, relative to a keyframe.
#[derive(Clone, Copy, Debug, PartialEq)]
struct FrameNode {
    stamp: Stamp,
    segment: u32,
    keyframe: usize,
    keyframe_from_camera: Pose,
    /// World from camera as it was measured: the pose where no keyframes are kept.
    measured: Pose,
}

/// Keyframes and frames of a run.
#[derive(Clone, Debug, Default)]
pub struct Map {
    keyframes: Vec<Keyframe>,
    frames: Vec<FrameNode>,
    edges: Vec<Edge>,
    epoch: u64,
}

impl Map {
    /// The keyframes, in the order in which they were made.
    pub fn keyframes(&self) -> &[Keyframe] {
        &self.keyframes
    }

    /// The motions between keyframes that the last [`Map::refine`] measured.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// Grows by one whenever keyframes move.
    pub fn epoch(&self) -> u64 {
        self.epoch
    }

    /// A keyframe of the odometry: a new one, or a better image of one that is there (its rolling
    /// shutter undone). Keyframes come in the order of their numbers.
    pub fn insert(&mut self, event: KeyframeEvent) {
        let index = event.index;
        if let Some(known) = self.keyframes.get_mut(index) {
            known.image = event.image;
            return;
        }
        if index != self.keyframes.len() {
            return; // of a chain whose beginning was not kept: frames then keep measured poses
        }
        if let (Some(_), Some(frame)) = (&event.parent, self.frames.last_mut()) {
            // The frame that became the keyframe hangs on itself from now on.
            frame.keyframe = index;
            frame.keyframe_from_camera = Pose::identity();
        }
        let covariance = event
            .parent
            .as_ref()
            .map_or_else(Matrix6::zeros, |parent| self.covariance_of(parent));
        self.keyframes.push(Keyframe::of(event, covariance));
    }

    /// Keeps where a frame hangs; frames without a measured pose are left out. Keyframes that the
    /// frame made are inserted before.
    pub fn hang(&mut self, result: &OdometryResult) {
        let newest_keyframe = self.keyframes.len().saturating_sub(1);
        let (keyframe, keyframe_from_camera) = match (&result.status, &result.keyframe_motion) {
            (_, Some(motion)) => (motion.keyframe, motion.keyframe_from_camera),
            (TrackStatus::Started, None) => (newest_keyframe, Pose::identity()),
            (TrackStatus::Skipped(Reason::DuplicateFrame), None) => match self.frames.last() {
                Some(last) => (last.keyframe, last.keyframe_from_camera),
                None => return,
            },
            _ => return,
        };
        self.frames.push(FrameNode {
            stamp: result.stamp,
            segment: result.segment,
            keyframe,
            keyframe_from_camera,
            measured: result.world_from_camera,
        });
    }

    /// Covariance of a pose measured against a keyframe, relative to the start of the segment,
    /// `[rotation, translation]` in the camera's frame.
    pub fn covariance_of(&self, motion: &KeyframeMotion) -> Matrix6<f64> {
        let keyframe = self.keyframes.get(motion.keyframe);
        let base = keyframe.map_or_else(Matrix6::zeros, |keyframe| keyframe.covariance);
        covariance::compose(&base, &motion.keyframe_from_camera, &motion.covariance)
    }

    /// Compares keyframes that see the same surface, and fits all keyframe poses to the motions
    /// found; see [`GraphConfig`]. Raising `stop` ends it after the comparison or step under way, with
    /// the poses of the last whole round. `progress` is told how many comparisons of how many are
    /// done.
    ///
    /// # Errors
    /// Where a setting of the graph is out of range.
    pub fn refine(
        &mut self,
        aligner: &mut Aligner,
        config: &GraphConfig,
        policy: &KeyframePolicy,
        stop: &StopFlag,
        mut progress: impl FnMut(usize, usize),
    ) -> Result<GraphReport> {
        config.validate()?;
        let before: Vec<Pose> = self.poses().collect();
        let mut report = GraphReport::of(self.keyframes.len());
        let total = config.rounds * self.keyframes.len();
        for round in 0..config.rounds {
            let mut told = |done| progress(round * self.keyframes.len() + done, total);
            let found =
                dense_edges::compare_all(&self.keyframes, aligner, config, policy, stop, &mut told);
            let Some(found) = found else {
                report.interrupted = true;
                break;
            };
            report.failed = found.failed;
            let solved = keyframe_graph::solve(&self.keyframes, &found.edges, stop)?;
            report.note(&found.edges, &solved);
            for (keyframe, pose) in self.keyframes.iter_mut().zip(&solved.poses) {
                keyframe.world_from_keyframe = *pose;
            }
            self.edges = found.edges;
        }
        report.largest_change_m = self
            .poses()
            .zip(&before)
            .map(|(pose, old)| (pose.translation - old.translation).norm())
            .fold(0.0, f64::max);
        self.epoch += 1;
        Ok(report)
    }

    /// The keyframe that the newest frame hangs on, by its number, and the frame's pose in it.
    pub fn newest(&self) -> Option<(usize, &Pose)> {
        let frame = self.frames.last();
        frame.map(|frame| (frame.keyframe, &frame.keyframe_from_camera))
    }

    /// Poses of all frames that have one, hung on their keyframes as those are now.
    ///
    /// # Errors
    /// None in practice: stamps of accepted frames increase.
    pub fn trajectory(&self) -> Result<Trajectory> {
        self.collected(|_| true)
    }

    /// The same of the frames of one segment.
    ///
    /// # Errors
    /// As [`Map::trajectory`].
    pub fn segment(&self, segment: u32) -> Result<Trajectory> {
        self.collected(|frame| frame.segment == segment)
    }

    fn collected(&self, wanted: impl Fn(&FrameNode) -> bool) -> Result<Trajectory> {
        let mut trajectory = Trajectory::new();
        for frame in self.frames.iter().filter(|frame| wanted(frame)) {
            let keyframe = self.keyframes.get(frame.keyframe);
            let hung = keyframe.map(|node| node.world_from_keyframe * frame.keyframe_from_camera);
            trajectory.push(frame.stamp, hung.unwrap_or(frame.measured))?;
        }
        Ok(trajectory)
    }

    fn poses(&self) -> impl Iterator<Item = Pose> + '_ {
        self.keyframes.iter().map(|node| node.world_from_keyframe)
    }
}
