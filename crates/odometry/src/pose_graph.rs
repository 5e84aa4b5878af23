//! A light pose graph: poses that fit measured motions between them best.
//!
//! Gauss and Newton with Cauchy's weights; the first pose stays where it is. The residual of an
//! edge is `log(a_from_b measured at the poses * inverse of the measurement)`, a twist in the frame
//! of `a`, where the covariance of an alignment lives.

use nalgebra::{Matrix6, Vector6};
use sphereflow_core::Pose;
use sphereflow_sphere::lie::se3;

/// Cauchy's constant, in standard deviations of an edge.
const CAUCHY: f64 = 2.5;
/// Steps at most; each is a whole Gauss-Newton step, as motions between keyframes are good guesses.
const ITERATIONS: usize = 100;
/// A step shorter than this, metres and radians, ends the iteration.
const SMALL_STEP: f64 = 1e-5;
/// Every pose is held where it is with this standard deviation, metres and radians: nothing beside
/// a measurement, but it keeps poses without any from drifting off.
const HOLD: f64 = 10.0;

/// A measured motion between two poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Edge {
    pub(crate) a: usize,
    pub(crate) b: usize,
    pub(crate) a_from_b: Pose,
    /// Inverse covariance of `[rotation, translation]` in the frame of `a`.
    pub(crate) information: Matrix6<f64>,
}

/// How a solve went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Solved {
    pub(crate) iterations: usize,
    pub(crate) converged: bool,
    /// Edges with less than half of their weight.
    pub(crate) rejected: usize,
}

/// Moves `poses` (world from body) to where the edges fit best. Poses are left as they were where
/// the equations have no solution.
pub(crate) fn solve(poses: &mut [Pose], edges: &[Edge]) -> Solved {
    let mut solved = Solved::default();
    if poses.len() < 2 || edges.is_empty() {
        solved.converged = true;
        return solved;
    }
    for _ in 0..ITERATIONS {
        let Some(step) = linear::step(poses, edges) else {
            return solved;
        };
        solved.iterations += 1;
        for (pose, delta) in poses.iter_mut().skip(1).zip(&step) {
            *pose = *pose * se3::exp(delta);
        }
        if step.iter().all(|delta| delta.norm() < SMALL_STEP) {
            solved.converged = true;
            break;
        }
    }
    let weak = |edge: &&Edge| weight(&residual(poses, edge), &edge.information) < 0.5;
    solved.rejected = edges.iter().filter(weak).count();
    solved
}

fn residual(poses: &[Pose], edge: &Edge) -> Vector6<f64> {
    let a_from_b = poses[edge.a].inverse() * poses[edge.b];
    se3::log(&(a_from_b * edge.a_from_b.inverse()))
}

fn weight(residual: &Vector6<f64>, information: &Matrix6<f64>) -> f64 {
    1.0 / (1.0 + residual.dot(&(information * residual)) / (CAUCHY * CAUCHY))
}

/// Residual of an edge with its derivatives by a step `pose * exp(delta)` of either pose.
fn linearised(poses: &[Pose], edge: &Edge) -> (Vector6<f64>, Matrix6<f64>, Matrix6<f64>) {
    let a_from_b = poses[edge.a].inverse() * poses[edge.b];
    let residual = se3::log(&(a_from_b * edge.a_from_b.inverse()));
    let left = se3::left_jacobian_inverse(&residual);
    (residual, -left, left * se3::adjoint(&a_from_b))
}

/// The sparse normal equations.
mod linear {
    use super::{Edge, HOLD, linearised, weight};
    use faer::Side;
    use faer::linalg::solvers::Solve;
    use faer::sparse::{SparseColMat, Triplet};
    use nalgebra::{Matrix6, Vector6};
    use sphereflow_core::Pose;

    /// Steps of all poses but the first; `None` where there is no solution.
    pub(super) fn step(poses: &[Pose], edges: &[Edge]) -> Option<Vec<Vector6<f64>>> {
        let unknown = 6 * (poses.len() - 1);
        let mut entries = Vec::with_capacity(36 * 3 * edges.len() + unknown);
        let mut right = faer::Mat::<f64>::zeros(unknown, 1);
        for i in 0..unknown {
            entries.push(Triplet::new(i, i, 1.0 / (HOLD * HOLD)));
        }
        for edge in edges {
            let (residual, by_a, by_b) = linearised(poses, edge);
            let information = edge.information * weight(&residual, &edge.information);
            for (row, by_row) in [(edge.a, &by_a), (edge.b, &by_b)] {
                let Some(row) = row.checked_sub(1) else {
                    continue; // the first pose does not move
                };
                let weighted = by_row.transpose() * information;
                let gradient = weighted * residual;
                for k in 0..6 {
                    right[(6 * row + k, 0)] -= gradient[k];
                }
                for (column, by_column) in [(edge.a, &by_a), (edge.b, &by_b)] {
                    if let Some(column) = column.checked_sub(1).filter(|&c| c <= row) {
                        add(&mut entries, 6 * row, 6 * column, &(weighted * by_column));
                    }
                }
            }
        }
        let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(unknown, unknown, &entries);
        let factor = matrix.ok()?.sp_cholesky(Side::Lower).ok()?;
        factor.solve_in_place(&mut right);
        let steps = (0..poses.len() - 1).map(|i| Vector6::from_fn(|k, _| right[(6 * i + k, 0)]));
        let steps: Vec<Vector6<f64>> = steps.collect();
        let finite = steps.iter().all(|step| step.iter().all(|v| v.is_finite()));
        finite.then_some(steps)
    }

    /// The lower triangle of a block, all of a block below the diagonal.
    fn add(
        entries: &mut Vec<Triplet<usize, usize, f64>>,
        row: usize,
        column: usize,
        block: &Matrix6<f64>,
    ) {
        for i in 0..6 {
            for j in 0..6 {
                if row + i >= column + j {
                    entries.push(Triplet::new(row + i, column + j, block[(i, j)]));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Poses along a wavy loop.
    fn truth(count: usize) -> Vec<Pose> {
        (0..count)
            .map(|i| {
                let a = i as f64 * std::f64::consts::TAU / count as f64;
                se3::exp(&Vector6::new(
                    0.3 * a.sin(),
                    a,
                    0.1 * (2.0 * a).cos(),
                    a.cos(),
                    0.2 * a.sin(),
                    a.sin(),
                ))
            })
            .collect()
    }

    fn edge(poses: &[Pose], a: usize, b: usize) -> Edge {
        Edge {
            a,
            b,
            a_from_b: poses[a].inverse() * poses[b],
            information: Matrix6::identity() * 1e4,
        }
    }

    fn disturbed(poses: &[Pose]) -> Vec<Pose> {
        let mut disturbed = poses.to_vec();
        for (i, pose) in disturbed.iter_mut().enumerate().skip(1) {
            let phase = i as f64;
            let by = Vector6::from_fn(|k, _| 0.05 * (phase * (1.3 + k as f64)).sin());
            *pose = *pose * se3::exp(&by);
        }
        disturbed
    }

    fn assert_same(found: &[Pose], expected: &[Pose], tolerance: f64) {
        for (found, expected) in found.iter().zip(expected) {
            let (d, a) = found.distance_and_angle(expected);
            assert!(d < tolerance && a < tolerance, "{d} {a}");
        }
    }

    #[test]
    fn residual_jacobians_are_the_differences() {
        let poses = disturbed(&truth(4));
        let edge = edge(&truth(4), 1, 3);
        let (_, by_a, by_b) = linearised(&poses, &edge);
        let step = 1e-6;
        for (which, jacobian) in [(1, by_a), (3, by_b)] {
            for k in 0..6 {
                let moved = |sign: f64| {
                    let mut poses = poses.clone();
                    let mut delta = Vector6::zeros();
                    delta[k] = sign * step;
                    poses[which] = poses[which] * se3::exp(&delta);
                    residual(&poses, &edge)
                };
                let difference = (moved(1.0) - moved(-1.0)) / (2.0 * step);
                let error = (difference - jacobian.column(k)).norm();
                assert!(error < 1e-8, "{which} {k}: {error}");
            }
        }
    }

    #[test]
    fn solve_finds_the_poses_of_exact_edges() {
        let exact = truth(20);
        let edges: Vec<Edge> = (0..20)
            .flat_map(|a| [(a, a + 1), (a, a + 5)])
            .filter(|&(_, b)| b < 20)
            .map(|(a, b)| edge(&exact, a, b))
            .collect();
        let mut poses = disturbed(&exact);
        let solved = solve(&mut poses, &edges);
        assert!(solved.converged, "{solved:?}");
        assert_same(&poses, &exact, 1e-4); // held where they were by 1e-6 of an edge's information
    }

    #[test]
    fn solve_leaves_a_wrong_edge_aside() {
        let exact = truth(20);
        let mut edges: Vec<Edge> = (0..19).map(|a| edge(&exact, a, a + 1)).collect();
        edges.extend((0..15).map(|a| edge(&exact, a, a + 4)));
        let mut wrong = edge(&exact, 2, 17);
        wrong.a_from_b = Pose::identity();
        edges.push(wrong);
        let mut poses = exact.clone();
        let solved = solve(&mut poses, &edges);
        assert_eq!(solved.rejected, 1, "{solved:?}");
        assert_same(&poses, &exact, 5e-3);
    }

    #[test]
    fn solve_without_edges_changes_nothing() {
        let mut poses = truth(5);
        assert!(solve(&mut poses, &[]).converged);
        assert_same(&poses, &truth(5), 0.0 + f64::EPSILON);
    }
}
