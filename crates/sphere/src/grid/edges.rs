//! The edges of one axis with what lies beside them and how a gradient flows through them.

use super::geometry::Edge;
use super::laplacian::FluxWeights;
use super::lattice::{Axis, Lattice, Sides};
use nalgebra::Vector3;

/// All edges across one axis, row after row.
#[derive(Clone, Debug)]
pub(super) struct EdgeTable {
    stride: usize,
    edges: Vec<Edge>,
    /// Their `normal_length` once more, side by side: a divergence reads nothing else of them, and
    /// reading is what it takes its time for.
    normals: Vec<Vector3<f64>>,
    sides: Vec<Sides>,
    weights: Vec<FluxWeights>,
}

impl EdgeTable {
    /// From the edges of `axis`: `width + 1` in a row across x, `width` across y.
    pub fn new(lattice: &Lattice, rays: &[Vector3<f64>], axis: Axis, edges: Vec<Edge>) -> Self {
        let stride = match axis {
            Axis::X => lattice.width + 1,
            Axis::Y => lattice.width,
        };
        let mut table = Self {
            stride,
            sides: Vec::with_capacity(edges.len()),
            weights: Vec::with_capacity(edges.len()),
            normals: edges.iter().map(|edge| edge.normal_length).collect(),
            edges,
        };
        for (index, edge) in table.edges.iter().enumerate() {
            let at = (index % stride, index / stride);
            let sides = match lattice.sides(axis, at.0, at.1) {
                _ if edge.is_point() => Sides::Closed,
                sides => sides,
            };
            table.sides.push(sides);
            table.weights.push(match sides {
                Sides::Inner => FluxWeights::new(lattice, rays, edge, axis, at),
                _ => FluxWeights::NOTHING,
            });
        }
        table
    }

    pub fn edge(&self, x: usize, y: usize) -> &Edge {
        &self.edges[y * self.stride + x]
    }

    pub fn normal(&self, x: usize, y: usize) -> &Vector3<f64> {
        &self.normals[y * self.stride + x]
    }

    pub fn sides(&self, x: usize, y: usize) -> Sides {
        self.sides[y * self.stride + x]
    }

    pub fn weights(&self, x: usize, y: usize) -> FluxWeights {
        self.weights[y * self.stride + x]
    }
}
