//! The graph's state, its normal equations, and their solution.

use super::group::Group;
use super::problem::{Edge, EdgeKind, PoseGraph};
use super::robust::{LoopSwitch, Weighted};
use crate::linear::{BlockPattern, NormalEquations};
use crate::minimise::{Step, System};
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

/// A graph with a candidate, the weights of its edges and the room to solve for a step.
pub(super) struct GraphState<G, const D: usize> {
    pub graph: PoseGraph<G, D>,
    candidate: Vec<G>,
    /// Weights of the edges by the robust switch, and which the matrix is laid out for.
    weights: Vec<f64>,
    laid_out: Vec<bool>,
    pub switch: LoopSwitch,
    block: Vec<Option<usize>>,
    offsets: Vec<Option<(usize, bool)>>,
    equations: NormalEquations,
    parts: Vec<Part<D>>,
    squares: Vec<f64>,
}

impl<G: Group<D>, const D: usize> GraphState<G, D> {
    /// Lay the graph out, with the nodes `hold` held.
    pub fn new(graph: PoseGraph<G, D>, hold: &[usize]) -> Self {
        let mut moves: Vec<bool> = graph.fixed.iter().map(|fixed| !fixed).collect();
        for &node in hold {
            moves[node] = false;
        }
        let mut blocks = 0;
        let mut number = |moves: bool| {
            blocks += usize::from(moves);
            moves.then(|| blocks - 1)
        };
        let block: Vec<_> = moves.into_iter().map(&mut number).collect();
        let weights = vec![1.0; graph.edges.len()];
        let pattern = pattern(&graph.edges, &weights, &block, blocks);
        Self {
            candidate: graph.nodes.clone(),
            laid_out: vec![true; weights.len()],
            weights,
            switch: LoopSwitch::Off,
            offsets: offsets(&graph.edges, &block, &pattern),
            block,
            equations: NormalEquations::new(pattern),
            parts: vec![Part::zeros(); graph.edges.len()],
            squares: vec![0.0; graph.edges.len()],
            graph,
        }
    }

    /// All edges believed, by this switch.
    pub fn begin(&mut self, switch: LoopSwitch) {
        self.switch = switch;
        self.weights.fill(1.0);
        self.lay_out();
    }

    /// Lay the normal matrix out again where edges have a weight that it has no room for, or many of
    /// those it has room for have none any more: wrong loops tie what is far apart, and cost most of
    /// the work until they are left out.
    fn lay_out(&mut self) {
        let (mut missing, mut gone, mut there) = (false, 0, 0);
        for (weight, laid_out) in self.weights.iter().zip(&self.laid_out) {
            let kept = *weight > 0.0;
            missing |= kept && !laid_out;
            gone += usize::from(*laid_out && !kept);
            there += usize::from(*laid_out);
        }
        if !missing && 100 * gone <= there {
            return;
        }
        let edges = &self.graph.edges;
        let blocks = self.equations.pattern.blocks();
        let pattern = pattern(edges, &self.weights, &self.block, blocks);
        self.offsets = offsets(edges, &self.block, &pattern);
        self.equations.lay_out(pattern);
        for (laid_out, weight) in self.laid_out.iter_mut().zip(&self.weights) {
            *laid_out = *weight > 0.0;
        }
    }

    #[cfg(test)]
    pub(super) fn gradient(&self) -> &[f64] {
        self.equations.gradient()
    }

    /// Squared whitened residuals of the edges, at the state or the candidate.
    fn square(&mut self, candidate: bool) {
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
            cost += 0.5 * weight * self.switch.evaluate(edge.by(), *square).0;
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
                let weight = weight * switch.evaluate(edge.by(), residual.norm_squared()).1;
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
        let (equations, block) = (&mut self.equations, &self.block);
        let mut add = |node: usize, matrix: &SMatrix<f64, D, D>, g: &SVector<f64, D>| {
            if let Some(block) = block[node] {
                equations.add_diagonal(block, matrix.as_slice(), g.as_slice());
            }
        };
        for (part, edge) in self.parts.iter().zip(&self.graph.edges) {
            add(edge.from, &part.from, &part.from_gradient);
            add(edge.to, &part.to, &part.to_gradient);
        }
        for prior in &self.graph.priors {
            let (residual, jacobian) = prior.evaluate(&self.graph.nodes);
            let (normal, g) = (jacobian.tr_mul(&jacobian), jacobian.tr_mul(&residual));
            add(prior.node(), &normal, &g);
        }
        for (part, offset) in self.parts.iter().zip(&self.offsets) {
            match offset {
                Some((offset, true)) => {
                    equations.add_at(*offset, part.cross.transpose().as_slice());
                }
                Some((offset, false)) => equations.add_at(*offset, part.cross.as_slice()),
                None => {}
            }
        }
    }
}

impl<G: Group<D>, const D: usize> System for GraphState<G, D> {
    fn cost(&mut self) -> Option<f64> {
        Some(self.evaluate(false))
    }

    fn linearise(&mut self, _: Damping, _: f64) -> f64 {
        self.equations.clear();
        self.linearise_edges();
        self.gather();
        self.equations.gradient_max()
    }

    fn step(&mut self, damping: Damping, lambda: f64) -> Option<Step> {
        let step = self.equations.solve(damping, lambda)?;
        let mut state = 0.0;
        for (node, block) in self.block.iter().enumerate() {
            let here = &self.graph.nodes[node];
            state += 1.0 + here.pose().translation.norm_squared();
            if let Some(block) = block {
                let d = SVector::<f64, D>::from_column_slice(self.equations.of(*block));
                self.candidate[node] = here.compose(&G::exp(&d));
            }
        }
        Some(Step {
            promised: step.promised,
            norm: step.squared.sqrt(),
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

impl<G: Group<D>, const D: usize> Weighted for GraphState<G, D> {
    fn measure(&mut self) {
        self.square(false);
    }

    fn edges(&self) -> impl Iterator<Item = (EdgeKind, f64, f64)> {
        let all = (self.graph.edges.iter()).zip(self.squares.iter().zip(&self.weights));
        all.map(|(edge, (square, weight))| {
            let felt = weight * self.switch.evaluate(edge.by(), *square).1;
            (edge.kind, *square, felt)
        })
    }

    fn reweight(&mut self, weight: impl Fn(f64) -> f64) {
        let all = (self.weights.iter_mut()).zip(self.graph.edges.iter().zip(&self.squares));
        for (to, (edge, square)) in all {
            if edge.kind == EdgeKind::Loop {
                *to = weight(*square);
            }
        }
        self.lay_out();
    }
}

/// The blocks that edges with a weight tie.
fn pattern<G, const D: usize>(
    edges: &[Edge<G, D>],
    weights: &[f64],
    block: &[Option<usize>],
    blocks: usize,
) -> BlockPattern {
    let (mut starts, mut members) = (vec![0], Vec::new());
    for (edge, _) in edges.iter().zip(weights).filter(|(_, w)| **w > 0.0) {
        let ends = [block[edge.from], block[edge.to]];
        members.extend(ends.into_iter().flatten().map(|b| b as u32));
        starts.push(members.len());
    }
    BlockPattern::from_groups(vec![D; blocks], &starts, &members)
}

/// Where the block between the ends of each edge is, and whether it is transposed there; none where
/// it has no block (an end does not move, or the edge has no weight).
fn offsets<G, const D: usize>(
    edges: &[Edge<G, D>],
    block: &[Option<usize>],
    pattern: &BlockPattern,
) -> Vec<Option<(usize, bool)>> {
    let offset = |edge: &Edge<G, D>| {
        let (from, to) = (block[edge.from]?, block[edge.to]?);
        let offset = pattern.offset(from.max(to), from.min(to))?;
        Some((offset, from > to))
    };
    edges.iter().map(offset).collect()
}
