//! What can be done once more is known: keyframes compared with each other, and all poses fitted.

use crate::Result;
use crate::graph::KeyframeGraph;
use crate::odometry::DepthOdometry;
use crate::pose_graph::{self, Edge};
use nalgebra::{Matrix6, Vector6};
use sphereflow_alignment::{Alignment, Priors};
use sphereflow_core::{Pose, Trajectory};

/// What [`DepthOdometry::optimise`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OptimiseReport {
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
    /// Largest change of a keyframe's position, metres.
    pub largest_change_m: f64,
}

/// An aligned pair beyond this robust residual, in units of the noise, is not believed.
const MAX_SCALE: f64 = 5.0;
/// k: factor on the formal standard deviation of an alignment.
const FORMAL_SCALE: f64 = 2.0;

impl DepthOdometry {
    /// Compares keyframes that see the same surface, fits all keyframe poses to the measured
    /// motions, and moves the frames with them: see [`DepthOdometry::trajectory`]. The poses
    /// already given stay as they were; later frames go on from the corrected ones.
    pub fn optimise(&mut self) -> OptimiseReport {
        self.optimise_with(|_, _| {})
    }

    /// The same, telling how many keyframes of how many were compared.
    pub fn optimise_with(&mut self, mut progress: impl FnMut(usize, usize)) -> OptimiseReport {
        let mut report = OptimiseReport {
            keyframes: self.graph.keyframes.len(),
            converged: true,
            ..OptimiseReport::default()
        };
        let before: Vec<Pose> = self.graph.keyframes.iter().map(|k| k.pose).collect();
        let rounds = self.config.graph.rounds;
        for round in 0..rounds {
            let mut edges = parent_edges(&self.graph, &self.config.graph);
            (report.edges, report.failed) = (edges.len(), 0);
            for b in 1..report.keyframes {
                for (a, a_from_b) in self.candidates(b) {
                    match self.compare(a, b, a_from_b) {
                        Some(edge) => edges.push(edge),
                        None => report.failed += 1,
                    }
                }
                progress(round * report.keyframes + b + 1, rounds * report.keyframes);
            }
            report.edges = edges.len();
            let mut poses: Vec<Pose> = self.graph.keyframes.iter().map(|k| k.pose).collect();
            let solved = pose_graph::solve(&mut poses, &edges);
            (report.rejected, report.converged) = (solved.rejected, solved.converged);
            for (node, pose) in self.graph.keyframes.iter_mut().zip(&poses) {
                node.pose = *pose;
            }
        }
        let moved = self.graph.keyframes.iter().zip(&before);
        report.largest_change_m = moved
            .map(|(node, old)| (node.pose.translation - old.translation).norm())
            .fold(0.0, f64::max);
        self.follow_graph();
        report
    }

    /// Poses of all frames that have one: those of the results of `push` before
    /// [`DepthOdometry::optimise`], and hung on their corrected keyframes after it.
    ///
    /// # Errors
    /// None in practice: stamps of accepted frames increase.
    pub fn trajectory(&self) -> Result<Trajectory> {
        let mut trajectory = Trajectory::new();
        for frame in &self.graph.frames {
            let keyframe = self.graph.keyframes.get(frame.keyframe);
            let hung = keyframe.map(|node| node.pose * frame.keyframe_from_camera);
            trajectory.push(frame.stamp, hung.unwrap_or(frame.measured))?;
        }
        Ok(trajectory)
    }

    /// Earlier keyframes that may see what keyframe `b` sees, with the motion predicted.
    fn candidates(&mut self, b: usize) -> Vec<(usize, Pose)> {
        let config = self.config.graph;
        let mut found = Vec::new();
        for a in 0..b {
            let (node_a, node_b) = (&self.graph.keyframes[a], &self.graph.keyframes[b]);
            let a_from_b = node_a.pose.inverse() * node_b.pose;
            let (distance_m, angle_rad) = a_from_b.distance_and_angle(&Pose::identity());
            if distance_m > config.max_distance_m || angle_rad > config.max_angle_rad {
                continue;
            }
            let (overlap, _) = self.aligner.overlap_and_flow(&node_a.image, &a_from_b);
            if overlap > config.min_overlap {
                found.push((overlap, a, a_from_b));
            }
        }
        found.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
        found.truncate(config.max_edges);
        found.into_iter().map(|(_, a, pose)| (a, pose)).collect()
    }

    /// The measured motion between two keyframes; `None` where it is not to be believed.
    fn compare(&mut self, a: usize, b: usize, predicted: Pose) -> Option<Edge> {
        let config = &self.config;
        // The rolling shutter was undone when they became keyframes.
        let keyframes = &self.graph.keyframes;
        let alignment = self.aligner.align(
            &keyframes[a].image,
            &keyframes[b].image,
            predicted,
            &Priors::default(),
        );
        let surprise = (alignment.motion.translation - predicted.translation).norm();
        let good = alignment.settled
            && alignment.residual_scale < MAX_SCALE
            && alignment.overlap > config.keyframes.least_overlap
            && alignment.rank == 6
            && surprise < config.keyframes.max_surprise_m;
        let information = edge_covariance(config, &alignment)?.try_inverse()?;
        good.then_some(Edge {
            a,
            b,
            a_from_b: alignment.motion,
            information,
        })
    }

    /// The state of the tracking moves with its keyframe.
    fn follow_graph(&mut self) {
        let Some(keyframe) = &mut self.keyframe else {
            return;
        };
        if let Some(node) = self.graph.keyframes.get(keyframe.index) {
            let correction = node.pose * keyframe.pose.inverse();
            keyframe.pose = node.pose;
            self.last.pose = correction * self.last.pose;
            self.last_pose = correction * self.last_pose;
        }
    }
}

/// The measured motion from each keyframe to the one made before it.
fn parent_edges(graph: &KeyframeGraph, config: &crate::GraphConfig) -> Vec<Edge> {
    let nodes = graph.keyframes.iter().enumerate();
    nodes
        .filter_map(|(b, node)| {
            let parent = node.parent?;
            let information = (parent.covariance + floor(config)).try_inverse()?;
            Some(Edge {
                a: parent.keyframe,
                b,
                a_from_b: parent.keyframe_from_camera,
                information,
            })
        })
        .collect()
}

/// `None` where nothing was aligned.
fn edge_covariance(
    config: &crate::odometry::OdometryConfig,
    alignment: &Alignment,
) -> Option<Matrix6<f64>> {
    let ratio = FORMAL_SCALE / config.alignment.covariance.scale;
    let formal = alignment.formal_covariance(&config.alignment, 1.0)?;
    Some(formal * (ratio * ratio) + floor(&config.graph))
}

fn floor(config: &crate::GraphConfig) -> Matrix6<f64> {
    let (w, v) = (config.floor_rad.powi(2), config.floor_m.powi(2));
    Matrix6::from_diagonal(&Vector6::new(w, w, w, v, v, v))
}
