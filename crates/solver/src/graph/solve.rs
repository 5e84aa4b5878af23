//! The graph's normal equations, and their solution.

use super::group::Group;
use super::optimiser::GraphOptimiser;
use crate::linear::BlockPattern;
use crate::minimise::{Step, System, damping_term};
use crate::options::Damping;
use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

/// Edges that are linearised as one piece of work.
const PIECE: usize = 256;

/// One edge's part of the normal equations.
#[derive(Clone, Copy)]
pub(super) struct Part<const D: usize> {
    from: SMatrix<f64, D, D>,
    to: SMatrix<f64, D, D>,
    /// Row `to`, column `from`.
    cross: SMatrix<f64, D, D>,
    from_gradient: SVector<f64, D>,
    to_gradient: SVector<f64, D>,
}

impl<const D: usize> Part<D> {
    pub fn zeros() -> Self {
        Self {
            from: SMatrix::zeros(),
            to: SMatrix::zeros(),
            cross: SMatrix::zeros(),
            from_gradient: SVector::zeros(),
            to_gradient: SVector::zeros(),
        }
    }
}

impl<G: Group<D>, const D: usize> GraphOptimiser<G, D> {
    #[cfg(test)]
    pub(super) fn gradient(&self) -> &[f64] {
        &self.gradient
    }

    /// Squared whitened residuals of the edges, at the state or the candidate.
    pub fn square(&mut self, candidate: bool) {
        let nodes = if candidate {
            &self.candidate
        } else {
            &self.graph.nodes
        };
        let edges = &self.graph.edges;
        (self
            .squares
            .par_chunks_mut(PIECE)
            .zip(edges.par_chunks(PIECE)))
        .for_each(|(squares, edges)| {
            for (square, edge) in squares.iter_mut().zip(edges) {
                let relative = nodes[edge.from].inverse().compose(&nodes[edge.to]);
                let error = edge.measured.inverse().compose(&relative).log();
                *square = (edge.root * error).norm_squared();
            }
        });
    }

    fn evaluate(&mut self, candidate: bool) -> f64 {
        self.square(candidate);
        let mut cost = 0.0;
        for ((edge, weight), square) in self
            .graph
            .edges
            .iter()
            .zip(&self.weights)
            .zip(&self.squares)
        {
            cost += 0.5 * weight * self.switch.evaluate(edge.kind, *square).0;
        }
        let nodes = if candidate {
            &self.candidate
        } else {
            &self.graph.nodes
        };
        for prior in &self.graph.priors {
            cost += 0.5 * prior.evaluate(nodes).0.norm_squared();
        }
        cost
    }

    fn linearise_edges(&mut self) {
        let (nodes, edges, switch) = (&self.graph.nodes, &self.graph.edges, self.switch);
        let pieces = (self.parts.par_chunks_mut(PIECE))
            .zip(edges.par_chunks(PIECE))
            .zip(self.weights.par_chunks(PIECE));
        pieces.for_each(|((parts, edges), weights)| {
            for ((part, edge), weight) in parts.iter_mut().zip(edges).zip(weights) {
                let relative = nodes[edge.from].inverse().compose(&nodes[edge.to]);
                let error = edge.measured.inverse().compose(&relative).log();
                let residual = edge.root * error;
                let weight = weight * switch.evaluate(edge.kind, residual.norm_squared()).1;
                // measured^-1 exp(-d) relative = measured^-1 relative exp(-Ad(relative^-1) d)
                let by_to = edge.root * G::right_jacobian_inverse(&error);
                let back = -relative.inverse().adjoint();
                part.to = (by_to.transpose() * by_to) * weight;
                part.cross = part.to * back;
                part.from = back.transpose() * part.cross;
                part.to_gradient = by_to.tr_mul(&residual) * weight;
                part.from_gradient = back.tr_mul(&part.to_gradient);
            }
        });
    }

    /// The sum of the edges' parts, in their order.
    fn gather(&mut self) {
        let Self {
            pattern,
            block,
            values,
            gradient,
            ..
        } = self;
        let mut sum = Sum {
            pattern,
            block,
            values,
            gradient,
        };
        let parts = self.parts.iter().zip(&self.graph.edges).zip(&self.offsets);
        for ((part, edge), offset) in parts {
            sum.add_diagonal(edge.from, &part.from, &part.from_gradient);
            sum.add_diagonal(edge.to, &part.to, &part.to_gradient);
            match offset {
                Some((offset, true)) => sum.add_block(*offset, &part.cross.transpose()),
                Some((offset, false)) => sum.add_block(*offset, &part.cross),
                None => {}
            }
        }
        for prior in &self.graph.priors {
            let (residual, jacobian) = prior.evaluate(&self.graph.nodes);
            let (normal, g) = (jacobian.tr_mul(&jacobian), jacobian.tr_mul(&residual));
            sum.add_diagonal(prior.node(), &normal, &g);
        }
    }
}

/// Normal matrix and gradient while they are summed.
struct Sum<'a> {
    pattern: &'a BlockPattern,
    block: &'a [Option<usize>],
    values: &'a mut [f64],
    gradient: &'a mut [f64],
}

impl Sum<'_> {
    fn add_diagonal<const D: usize>(
        &mut self,
        node: usize,
        matrix: &SMatrix<f64, D, D>,
        g: &SVector<f64, D>,
    ) {
        if let Some(block) = self.block[node] {
            self.add_block(self.pattern.diagonal(block), matrix);
            let start = self.pattern.start(block);
            for (to, entry) in self.gradient[start..start + D].iter_mut().zip(g.iter()) {
                *to += entry;
            }
        }
    }

    fn add_block<const D: usize>(&mut self, offset: usize, matrix: &SMatrix<f64, D, D>) {
        let to = &mut self.values[offset..offset + D * D];
        for (to, entry) in to.iter_mut().zip(matrix.as_slice()) {
            *to += entry;
        }
    }
}

impl<G: Group<D>, const D: usize> System for GraphOptimiser<G, D> {
    fn cost(&mut self) -> Option<f64> {
        Some(self.evaluate(false))
    }

    fn linearise(&mut self, _: Damping, _: f64) -> f64 {
        self.values.fill(0.0);
        self.gradient.fill(0.0);
        self.linearise_edges();
        self.gather();
        self.gradient.iter().fold(0.0, |most, g| most.max(g.abs()))
    }

    fn step(&mut self, damping: Damping, lambda: f64) -> Option<Step> {
        self.damped.copy_from_slice(&self.values);
        for block in 0..self.pattern.blocks() {
            let offset = self.pattern.diagonal(block);
            for k in 0..D {
                let at = offset + k * (D + 1);
                self.damped[at] += damping_term(damping, lambda, self.values[at]);
            }
        }
        for (step, gradient) in self.step.iter_mut().zip(&self.gradient) {
            *step = -gradient;
        }
        let solved = self.solver.factor(&self.pattern, &self.damped)
            && self
                .solver
                .solve(&self.pattern, &self.damped, &mut self.step);
        if !solved {
            return None;
        }
        let (mut promised, mut squared, mut state) = (0.0, 0.0, 0.0);
        for (node, block) in self.block.iter().enumerate() {
            let here = &self.graph.nodes[node];
            state += 1.0 + here.pose().translation.norm_squared();
            let Some(block) = block else { continue };
            let (start, offset) = (self.pattern.start(*block), self.pattern.diagonal(*block));
            let d = SVector::<f64, D>::from_column_slice(&self.step[start..start + D]);
            for k in 0..D {
                let term = damping_term(damping, lambda, self.values[offset + k * (D + 1)]);
                promised += 0.5 * d[k] * (term * d[k] - self.gradient[start + k]);
            }
            squared += d.norm_squared();
            self.candidate[node] = here.compose(&G::exp(&d));
        }
        Some(Step {
            promised,
            norm: squared.sqrt(),
            state_norm: f64::sqrt(state),
        })
    }

    fn candidate_cost(&mut self) -> Option<f64> {
        Some(self.evaluate(true))
    }

    fn accept(&mut self) {
        self.graph.nodes.copy_from_slice(&self.candidate);
    }
}
