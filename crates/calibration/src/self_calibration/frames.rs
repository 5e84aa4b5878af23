//! The frames of a recording as the calibration keeps them: block averages, poses, velocities.

use super::SelfCalibrationConfig;
use nalgebra::Vector6;
use sphereflow_alignment::binning::InverseDepth;
use sphereflow_alignment::twist_from_pose;
use sphereflow_core::{Pose, Stamp};

/// One frame with a measured pose.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    pub(super) stamp: Stamp,
    /// As it was measured: nothing is corrected yet.
    pub(super) measured: InverseDepth,
    pub(super) world_from_camera: Pose,
    /// Frames of different segments have no known motion between them.
    pub(super) segment: u32,
    pub(super) mean_distance_m: f64,
}

/// Two frames and the motion between their stamps.
#[derive(Clone, Debug)]
pub(super) struct FramePair {
    pub(super) first: usize,
    pub(super) second: usize,
    /// `first_from_second`.
    pub(super) motion: Pose,
}

/// Longest time over which a velocity is taken for constant, seconds.
const LONGEST_S: f64 = 0.25;

/// Velocity `[omega, v]` of each frame at its stamp: from the frame before to the frame after, or
/// from one neighbour at an end; at rest where neither is near.
pub(super) fn velocities(frames: &[Frame]) -> Vec<Vector6<f64>> {
    let near = |i: usize, j: usize| {
        let (a, b) = (frames.get(i)?, frames.get(j)?);
        let seconds = b.stamp.seconds_since(a.stamp);
        (a.segment == b.segment && seconds <= LONGEST_S).then_some((a, b, seconds))
    };
    (0..frames.len())
        .map(|i| {
            let before = i.checked_sub(1);
            let pair = before.and_then(|h| near(h, i + 1));
            let pair = pair.or_else(|| before.and_then(|h| near(h, i)));
            let Some((a, b, seconds)) = pair.or_else(|| near(i, i + 1)) else {
                return Vector6::zeros();
            };
            let motion = a.world_from_camera.inverse() * b.world_from_camera;
            twist_from_pose(&motion, seconds).vector()
        })
        .collect()
}

/// Frame `second` and the one before it, where a velocity can be had from them.
pub(super) fn frame_step(frames: &[Frame], second: usize) -> Option<FramePair> {
    let first = second.checked_sub(1)?;
    let (a, b) = (frames.get(first)?, frames.get(second)?);
    let near = a.segment == b.segment && b.stamp.seconds_since(a.stamp) <= LONGEST_S;
    near.then(|| FramePair {
        first,
        second,
        motion: a.world_from_camera.inverse() * b.world_from_camera,
    })
}

/// Steps from one distance between the frames of a pair to the next: about a factor of 1.5.
const GAP_FACTOR: f64 = 1.5;

/// Pairs of frames that moved enough against each other and still see the same, spread evenly.
pub(super) fn pairs(frames: &[Frame], config: &SelfCalibrationConfig) -> Vec<FramePair> {
    let mut found = Vec::new();
    for first in 0..frames.len() {
        let mut gap = config.min_gap;
        while gap <= config.max_gap {
            found.extend(frame_pair(frames, first, first + gap, config));
            gap = (gap as f64 * GAP_FACTOR).ceil() as usize;
        }
    }
    let (many, wanted) = (found.len(), config.max_pairs.min(found.len()));
    // Of n in order, every (n / wanted)-th: coprime steps walk through all distances.
    (0..wanted)
        .filter_map(|k| found.get(k * many / wanted.max(1)).cloned())
        .collect()
}

fn frame_pair(
    frames: &[Frame],
    first: usize,
    second: usize,
    config: &SelfCalibrationConfig,
) -> Option<FramePair> {
    let (a, b) = (frames.get(first)?, frames.get(second)?);
    let motion = a.world_from_camera.inverse() * b.world_from_camera;
    let (distance_m, angle) = motion.distance_and_angle(&Pose::identity());
    let moved_m = distance_m + a.mean_distance_m * angle;
    let good = a.segment == b.segment
        && moved_m >= config.min_motion_m
        && angle <= config.max_turn_rad
        && distance_m <= config.max_distance_m;
    good.then_some(FramePair {
        first,
        second,
        motion,
    })
}
