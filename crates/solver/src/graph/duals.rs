//! Jacobians of edges and priors against dual numbers, for poses and similarities.

use super::prior::Prior;
use super::solve::GraphState;
use super::tests::sample;
use super::*;
use crate::Damping;
use crate::dual::Square;
use crate::dual::{Dual, c, hat, matrix, nudge, squared, tangent, vector};
use crate::minimise::System;
use nalgebra::SMatrix;
use sphereflow_core::Pose;

/// Rounding of a few hundred products and of matrix square roots, relative to the largest entry.
const RELATIVE: f64 = 1e-9;

/// A group element with its scale as a matrix.
trait AsMatrix {
    fn dual(&self) -> Square<4>;
}

impl AsMatrix for Pose {
    fn dual(&self) -> Square<4> {
        matrix(self, 1.0)
    }
}

impl AsMatrix for Similarity {
    fn dual(&self) -> Square<4> {
        matrix(&self.pose, self.scale)
    }
}

fn first<const D: usize>(all: [Dual; 7]) -> [Dual; D] {
    std::array::from_fn(|k| all[k])
}

/// The rotation of a transform with a scale.
fn rotation(m: &Square<4>, scale: f64) -> Square<3> {
    // the scale's own derivative turns nothing: it is divided out by the determinant's root
    let r = Square::<3>::from_fn(|i, k| m.0[i][k] / c(scale));
    let columns = (0..3).fold(c(0.0), |sum, i| sum + r.0[i][0] * r.0[i][0]);
    Square::from_fn(|i, k| r.0[i][k] / columns.sqrt())
}

fn cost<G: Group<D> + AsMatrix, const D: usize>(
    graph: &PoseGraph<G, D>,
    scales: &[f64],
    moved: (usize, usize),
) -> Dual {
    let nodes: Vec<Square<4>> = (graph.nodes().iter().enumerate())
        .map(|(k, node)| match k == moved.0 {
            // the update is from the right
            true => node.dual().times(&nudge(moved.1)),
            false => node.dual(),
        })
        .collect();
    let mut sum = c(0.0);
    for edge in &graph.edges {
        let measured = edge.measured.dual().inverse();
        let relative = nodes[edge.from].inverse().times(&nodes[edge.to]);
        sum = sum + squared::<D>(&edge.root, first(tangent(&measured.times(&relative))));
    }
    for prior in &graph.priors {
        sum = sum
            + match prior {
                Prior::Whole {
                    node,
                    inverse,
                    root,
                } => squared::<D>(root, first(tangent(&inverse.dual().times(&nodes[*node])))),
                Prior::Gravity {
                    node,
                    world,
                    body,
                    root,
                } => {
                    let back = rotation(&nodes[*node], scales[*node]).transposed();
                    let seen = back.apply(vector(world));
                    let gap: [Dual; 3] = std::array::from_fn(|k| seen[k] - c(body[k]));
                    squared(&(SMatrix::<f64, 3, 3>::identity() * *root), gap)
                }
                Prior::Yaw {
                    node,
                    axis,
                    known,
                    root,
                } => {
                    let known = known.inverse().to_rotation_matrix().into_inner();
                    let turned = rotation(&nodes[*node], scales[*node]);
                    let log = turned.times(&Square::constant(&known)).log().0;
                    let turn = [log[2][1], log[0][2], log[1][0]];
                    let about = (0..3).fold(c(0.0), |sum, k| sum + turn[k] * c(axis[k]));
                    about * about * c(root * root)
                }
            };
    }
    sum * c(0.5)
}

fn check<G: Group<D> + AsMatrix, const D: usize>(scale_of: impl Fn(&G) -> f64) {
    let graph = sample::<G, D>();
    let again = graph.clone();
    let scales: Vec<f64> = again.nodes().iter().map(scale_of).collect();
    let mut system = GraphState::new(graph, &[]);
    let value = system.cost().unwrap();
    system.linearise(Damping::Identity, 0.0);
    let analytic = system.gradient().to_vec();
    let scale = analytic.iter().fold(1.0, |most: f64, g| most.max(g.abs()));
    for node in 0..3 {
        for axis in 0..D {
            let dual = cost(&again, &scales, (node, axis));
            assert!((dual.v - value).abs() < RELATIVE * value);
            let error = (dual.d - analytic[D * node + axis]).abs();
            assert!(error < RELATIVE * scale, "{node} {axis} {error:e}");
        }
    }
}

#[test]
fn gradient_equals_dual_numbers_for_poses_and_similarities() {
    check::<Pose, 6>(|_| 1.0);
    check::<Similarity, 7>(|node| node.scale);
}

#[test]
fn hat_matrix_times_vector_is_the_cross_product() {
    let (a, b) = (
        nalgebra::Vector3::new(1.0, 2.0, 3.0),
        nalgebra::Vector3::new(-2.0, 0.5, 1.0),
    );
    let found = hat(vector(&a)).apply(vector(&b));
    for (found, expected) in found.iter().zip(a.cross(&b).iter()) {
        assert_eq!(found.v, *expected);
    }
}
