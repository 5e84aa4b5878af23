//! The graph's normal equations, and their solution.

use super::group::Group;
use super::problem::{Edge, GraphIssue, PoseGraph};
use super::robust::{LoopSwitch, RobustSummary, graduate};
use crate::Result;
use crate::linear::{BlockPattern, BlockSolver, LinearSolver};
use crate::minimise::{Step, System, damping_term, minimise};
use crate::options::{Damping, Options};
use crate::summary::Summary;
use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

/// Edges that are linearised as one piece of work.
const PIECE: usize = 256;

/// What an adjustment of a graph did, and what is wrong with the graph.
#[derive(Clone, Debug, PartialEq)]
pub struct GraphSummary {
    /// Costs, iterations, and why they ended; of the last pass where there were several.
    pub summary: Summary,
    /// What the measurements do not determine.
    pub issues: Vec<GraphIssue>,
    /// What the robust switch did.
    pub robust: RobustSummary,
}

/// One edge's part of the normal equations.
#[derive(Clone, Copy)]
struct Part<const D: usize> {
    from: SMatrix<f64, D, D>,
    to: SMatrix<f64, D, D>,
    /// Row `to`, column `from`.
    cross: SMatrix<f64, D, D>,
    from_gradient: SVector<f64, D>,
    to_gradient: SVector<f64, D>,
}

pub(super) struct GraphSystem<'a, G, const D: usize> {
    pub graph: &'a mut PoseGraph<G, D>,
    candidate: Vec<G>,
    /// Weights of the edges by the robust switch.
    pub weights: Vec<f64>,
    pub switch: LoopSwitch,
    block: Vec<Option<usize>>,
    offsets: Vec<Option<(usize, bool)>>,
    pattern: BlockPattern,
    solver: BlockSolver,
    parts: Vec<Part<D>>,
    squares: Vec<f64>,
    values: Vec<f64>,
    damped: Vec<f64>,
    gradient: Vec<f64>,
    step: Vec<f64>,
}

impl<G: Group<D>, const D: usize> PoseGraph<G, D> {
    /// Minimise from the present state on, in place.
    ///
    /// # Errors
    /// Where a setting is outside its domain.
    pub fn solve(&mut self, switch: LoopSwitch, options: &Options) -> Result<GraphSummary> {
        switch.check()?;
        let (hold, issues) = self.gauge();
        let mut system = GraphSystem::new(self, &hold, switch);
        let (summary, robust) = match switch {
            LoopSwitch::Graduated { threshold } => graduate(&mut system, threshold, options)?,
            _ => {
                let summary = minimise(&mut system, options)?;
                let robust = system.judge();
                (summary, robust)
            }
        };
        Ok(GraphSummary {
            summary,
            issues,
            robust,
        })
    }
}

impl<'a, G: Group<D>, const D: usize> GraphSystem<'a, G, D> {
    pub(super) fn new(graph: &'a mut PoseGraph<G, D>, hold: &[usize], switch: LoopSwitch) -> Self {
        let mut blocks = 0;
        let block: Vec<Option<usize>> = (0..graph.nodes.len())
            .map(|node| {
                let free = !graph.fixed[node] && !hold.contains(&node);
                blocks += usize::from(free);
                free.then(|| blocks - 1)
            })
            .collect();
        let weights = vec![1.0; graph.edges.len()];
        let pattern = pattern::<G, D>(&graph.edges, &weights, &block, blocks);
        let offsets = offsets(&graph.edges, &block, &pattern);
        let (zero, vector) = (SMatrix::zeros(), SVector::zeros());
        let part = Part {
            from: zero,
            to: zero,
            cross: zero,
            from_gradient: vector,
            to_gradient: vector,
        };
        Self {
            candidate: graph.nodes.clone(),
            weights,
            switch,
            block,
            offsets,
            solver: BlockSolver::new(&pattern, LinearSolver::Auto),
            parts: vec![part; graph.edges.len()],
            squares: vec![0.0; graph.edges.len()],
            values: vec![0.0; pattern.len()],
            damped: vec![0.0; pattern.len()],
            gradient: vec![0.0; pattern.dimension()],
            step: vec![0.0; pattern.dimension()],
            pattern,
            graph,
        }
    }

    /// Lay the normal matrix out again for the edges that have a weight now.
    pub(super) fn restructure(&mut self) {
        let edges = &self.graph.edges;
        let blocks = self.pattern.blocks();
        self.pattern = pattern::<G, D>(edges, &self.weights, &self.block, blocks);
        self.offsets = offsets(edges, &self.block, &self.pattern);
        self.solver = BlockSolver::new(&self.pattern, LinearSolver::Auto);
        self.values.resize(self.pattern.len(), 0.0);
        self.damped.resize(self.pattern.len(), 0.0);
    }

    #[cfg(test)]
    pub fn gradient(&self) -> &[f64] {
        &self.gradient
    }

    /// Squared whitened residuals of the edges, at the state or the candidate.
    pub fn squares(&mut self, candidate: bool) -> &[f64] {
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
        &self.squares
    }

    fn evaluate(&mut self, candidate: bool) -> f64 {
        self.squares(candidate);
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
                let to = edge.root * G::right_jacobian_inverse(&error);
                let from = -to * relative.inverse().adjoint();
                part.from = from.tr_mul(&from) * weight;
                part.to = to.tr_mul(&to) * weight;
                part.cross = to.tr_mul(&from) * weight;
                part.from_gradient = from.tr_mul(&residual) * weight;
                part.to_gradient = to.tr_mul(&residual) * weight;
            }
        });
    }

    fn add_diagonal(&mut self, node: usize, matrix: &SMatrix<f64, D, D>, g: &SVector<f64, D>) {
        if let Some(block) = self.block[node] {
            let (offset, start) = (self.pattern.diagonal(block), self.pattern.start(block));
            for (k, entry) in matrix.iter().enumerate() {
                self.values[offset + k] += entry;
            }
            for (k, entry) in g.iter().enumerate() {
                self.gradient[start + k] += entry;
            }
        }
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

impl<G: Group<D>, const D: usize> System for GraphSystem<'_, G, D> {
    fn cost(&mut self) -> Option<f64> {
        Some(self.evaluate(false))
    }

    fn linearise(&mut self, _: Damping, _: f64) -> f64 {
        self.values.fill(0.0);
        self.gradient.fill(0.0);
        self.linearise_edges();
        for k in 0..self.parts.len() {
            let part = self.parts[k];
            let (from, to) = (self.graph.edges[k].from, self.graph.edges[k].to);
            self.add_diagonal(from, &part.from, &part.from_gradient);
            self.add_diagonal(to, &part.to, &part.to_gradient);
            if let Some((offset, transposed)) = self.offsets[k] {
                for r in 0..D {
                    for c in 0..D {
                        let entry = part.cross[(r, c)];
                        let (row, column) = if transposed { (c, r) } else { (r, c) };
                        self.values[offset + column * D + row] += entry;
                    }
                }
            }
        }
        for k in 0..self.graph.priors.len() {
            let (residual, jacobian) = self.graph.priors[k].evaluate(&self.graph.nodes);
            let node = self.graph.priors[k].node();
            let (normal, g) = (jacobian.tr_mul(&jacobian), jacobian.tr_mul(&residual));
            self.add_diagonal(node, &normal, &g);
        }
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
