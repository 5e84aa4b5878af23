//! Keyframe poses that fit the measured motions between them best, by the solver's pose graph.

use super::keyframe::Keyframe;
use nalgebra::Matrix6;
use sphereflow_core::{Error, Pose, Result};
use sphereflow_solver::graph::{GraphSummary, LoopSwitch, PoseGraph};
use sphereflow_solver::{Loss, Options, StopFlag, StopReason};
use sphereflow_sphere::lie::se3;

/// Cauchy's constant, in standard deviations of an edge: a measurement that is off by this counts
/// half. Smaller: wrong alignments bend the graph less, right ones that are merely off count less.
const CAUCHY: f64 = 2.5;
/// Steps at most: motions between keyframes are good guesses, a handful suffices.
const ITERATIONS: usize = 100;
/// A step that changes the poses by a smaller share than this ends the fit: 10 um of a metre.
const SMALL_STEP: f64 = 1e-5;
/// A step that lowers the cost by a smaller share ends it too.
const SMALL_GAIN: f64 = 1e-9;

/// A measured motion between two keyframes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Number of the first keyframe.
    pub a: usize,
    /// Number of the second.
    pub b: usize,
    /// Pose of the second in the frame of the first.
    pub a_from_b: Pose,
    /// Inverse covariance, `[rotation, translation]` in the frame of the first: of the `xi` in
    /// `exp(xi) * a_from_b`, where an alignment measures it.
    pub information: Matrix6<f64>,
}

impl Edge {
    /// Inverse covariance in the frame of the second: of the `xi` in `a_from_b * exp(xi)`.
    pub fn information_of_second(&self) -> Matrix6<f64> {
        let carry = se3::adjoint(&self.a_from_b);
        let information = carry.transpose() * self.information * carry;
        (information + information.transpose()) / 2.0
    }
}

/// What [`super::Map::refine`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GraphReport {
    /// Keyframes of the run.
    pub keyframes: usize,
    /// Pairs of keyframes whose motion was measured.
    pub edges: usize,
    /// Those of them that do not fit the others, and hardly count.
    pub rejected: usize,
    /// Pairs that were compared without result.
    pub failed: usize,
    /// False where the fit did not settle: the poses are then those of the last step.
    pub converged: bool,
    /// True where it was ended before its last round.
    pub interrupted: bool,
    /// Largest change of a keyframe's position, metres.
    pub largest_change_m: f64,
}

/// Fitted poses.
pub(super) struct Solved {
    pub(super) poses: Vec<Pose>,
    rejected: usize,
    converged: bool,
}

impl GraphReport {
    pub(super) fn of(keyframes: usize) -> Self {
        Self {
            keyframes,
            converged: true,
            ..Self::default()
        }
    }

    pub(super) fn note(&mut self, edges: &[Edge], solved: &Solved) {
        self.edges = edges.len();
        self.rejected = solved.rejected;
        self.converged = solved.converged;
    }
}

/// Fits the keyframes' poses to the edges; the first keyframe stays where it is, and so does one
/// that no edge ties to it.
pub(super) fn solve(keyframes: &[Keyframe], edges: &[Edge], stop: &StopFlag) -> Result<Solved> {
    let mut graph = graph_of(keyframes, edges).map_err(of_solver)?;
    let options = Options {
        max_iterations: ITERATIONS,
        function_tolerance: SMALL_GAIN,
        parameter_tolerance: SMALL_STEP,
        stop: stop.clone(),
        ..Options::default()
    };
    let summary = graph.solve(LoopSwitch::Off, &options).map_err(of_solver)?;
    Ok(Solved {
        poses: graph.nodes().to_vec(),
        rejected: summary.robust.rejected.len(),
        converged: settled(&summary),
    })
}

fn graph_of(
    keyframes: &[Keyframe],
    edges: &[Edge],
) -> sphereflow_solver::Result<PoseGraph<Pose, 6>> {
    let mut graph = PoseGraph::new();
    for keyframe in keyframes {
        graph.add_node(keyframe.world_from_keyframe)?;
    }
    if !keyframes.is_empty() {
        graph.fix_node(0)?;
    }
    for edge in edges {
        // The graph's residuals are twists in the frame of the second pose.
        let (ends, loss) = ((edge.a, edge.b), Loss::Cauchy(CAUCHY));
        graph.add_alignment(ends, edge.a_from_b, &edge.information, loss)?;
    }
    Ok(graph)
}

fn settled(summary: &GraphSummary) -> bool {
    !matches!(
        summary.summary.stop,
        StopReason::MaxIterations | StopReason::Interrupted
    )
}

/// What was given is the map's own: its numbers are named as the solver names them.
fn of_solver(error: sphereflow_solver::Error) -> Error {
    Error::value("keyframe graph", "a graph that can be solved", error)
}
