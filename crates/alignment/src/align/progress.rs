//! How far an alignment has come: its motion, and whether the steps shrink.

use crate::motion::size_m;
use crate::robust::Solution;
use nalgebra::Vector6;
use sphereflow_core::Pose;
use sphereflow_sphere::lie::se3;

/// A last step beyond this is followed by another one, metres: rotation counts at the mean range.
/// Smaller costs solves; larger leaves motions between the levels' solves unfinished.
const STILL_M: f64 = 5e-3;

/// The state of one descent through the levels.
pub(super) struct Progress {
    /// `keyframe_from_frame`, as far as known.
    pub(super) motion: Pose,
    /// Share of blocks known in both images at the last level looked at.
    pub(super) known_share: f64,
    /// Last solve.
    pub(super) last: Option<Solution>,
    /// Robust residual with which the first solve began.
    pub(super) scale_at_start: f64,
    /// Size of the last step.
    step_m: f64,
    /// False where the last step was larger than the one before.
    pub(super) settled: bool,
    pub(super) solves: usize,
}

impl Progress {
    pub(super) fn from(guess: Pose) -> Self {
        Self {
            motion: guess,
            known_share: 0.0,
            last: None,
            scale_at_start: f64::NAN,
            step_m: f64::INFINITY,
            settled: true,
            solves: 0,
        }
    }

    /// True where a further solve would add nothing. A single level is meant to be solved once: for
    /// slow motions, in a fraction of the time.
    pub(super) fn is_done(&self, single_level: bool) -> bool {
        self.settled && (self.step_m < STILL_M || single_level)
    }

    /// Takes the step of a solve. Steps below `floor_m` count as settled.
    pub(super) fn step(&mut self, solution: Solution, floor_m: f64) {
        if self.solves == 0 {
            self.scale_at_start = solution.scale_at_rest;
        }
        self.solves += 1;
        let twist: &Vector6<f64> = &solution.twist;
        self.motion = se3::exp(twist) * self.motion;
        let size = size_m(twist, solution.mean_range_m);
        self.settled = size < self.step_m.max(floor_m) || self.solves == 1;
        self.step_m = size;
        self.last = Some(solution);
    }
}
