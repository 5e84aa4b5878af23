//! A pose graph laid out once, then solved as often as wanted.

use super::group::Group;
use super::problem::{Edge, GraphIssue, PoseGraph};
use super::robust::{LoopSwitch, RobustSummary, graduate};
use super::solve::Part;
use crate::linear::{BlockPattern, BlockSolver, LinearSolver};
use crate::minimise::minimise;
use crate::options::Options;
use crate::summary::Summary;
use crate::{Error, Result};

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

/// A graph with everything that its minimisation needs: the order of elimination and the room for
/// the factor. Solving again, from other nodes, allocates nothing but the summary; graduated
/// non-convexity lays the matrix out again for the edges that are left.
pub struct GraphOptimiser<G, const D: usize> {
    pub(super) graph: PoseGraph<G, D>,
    issues: Vec<GraphIssue>,
    pub(super) candidate: Vec<G>,
    /// Weights of the edges by the robust switch, and which the matrix is laid out for.
    pub(super) weights: Vec<f64>,
    laid_out: Vec<bool>,
    pub(super) switch: LoopSwitch,
    pub(super) block: Vec<Option<usize>>,
    pub(super) offsets: Vec<Option<(usize, bool)>>,
    pub(super) pattern: BlockPattern,
    pub(super) solver: BlockSolver,
    pub(super) parts: Vec<Part<D>>,
    pub(super) squares: Vec<f64>,
    pub(super) values: Vec<f64>,
    pub(super) damped: Vec<f64>,
    pub(super) gradient: Vec<f64>,
    pub(super) step: Vec<f64>,
}

impl<G: Group<D>, const D: usize> PoseGraph<G, D> {
    /// Minimise from the present state on, in place; [`GraphOptimiser`] keeps what was laid out.
    ///
    /// # Errors
    /// Where a setting is outside its domain.
    pub fn solve(&mut self, switch: LoopSwitch, options: &Options) -> Result<GraphSummary> {
        let mut optimiser = GraphOptimiser::new(std::mem::take(self));
        let summary = optimiser.solve(switch, options);
        *self = optimiser.into_graph();
        summary
    }
}

impl<G: Group<D>, const D: usize> GraphOptimiser<G, D> {
    /// Lay the graph out. Its edges and what is fixed stay as they are from here on.
    pub fn new(graph: PoseGraph<G, D>) -> Self {
        let (hold, issues) = graph.gauge();
        let mut moves: Vec<bool> = graph.fixed.iter().map(|fixed| !fixed).collect();
        for node in hold {
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
            issues,
            candidate: graph.nodes.clone(),
            laid_out: vec![true; weights.len()],
            weights,
            switch: LoopSwitch::Off,
            offsets: offsets(&graph.edges, &block, &pattern),
            block,
            solver: BlockSolver::new(&pattern, LinearSolver::Auto),
            parts: vec![Part::zeros(); graph.edges.len()],
            squares: vec![0.0; graph.edges.len()],
            values: vec![0.0; pattern.len()],
            damped: vec![0.0; pattern.len()],
            gradient: vec![0.0; pattern.dimension()],
            step: vec![0.0; pattern.dimension()],
            pattern,
            graph,
        }
    }

    /// The graph in its present state.
    pub fn graph(&self) -> &PoseGraph<G, D> {
        &self.graph
    }

    /// The graph in its present state.
    pub fn into_graph(self) -> PoseGraph<G, D> {
        self.graph
    }

    /// Start from other nodes, given for all of them.
    ///
    /// # Errors
    /// Where their number is wrong, or a number is not finite.
    pub fn restart(&mut self, nodes: &[G]) -> Result<()> {
        let expected = self.graph.nodes.len();
        if nodes.len() != expected {
            return Err(Error::value("nodes", expected, nodes.len()));
        }
        for (node, world_from_body) in nodes.iter().enumerate() {
            self.graph.set_node(node, *world_from_body)?;
        }
        Ok(())
    }

    /// Minimise from the present state on.
    ///
    /// # Errors
    /// Where a setting is outside its domain.
    pub fn solve(&mut self, switch: LoopSwitch, options: &Options) -> Result<GraphSummary> {
        switch.check()?;
        options.check()?;
        self.switch = switch;
        self.weights.fill(1.0);
        self.lay_out();
        let (summary, robust) = match switch {
            LoopSwitch::Graduated { threshold } => graduate(self, threshold, options)?,
            _ => {
                let summary = minimise(self, options)?;
                (summary, self.judge())
            }
        };
        Ok(GraphSummary {
            summary,
            issues: self.issues.clone(),
            robust,
        })
    }

    /// Lay the normal matrix out again where edges have a weight that it has no room for, or many of
    /// those it has room for have none any more: wrong loops tie what is far apart, and cost most of
    /// the work until they are left out.
    pub(super) fn lay_out(&mut self) {
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
        let blocks = self.pattern.blocks();
        self.pattern = pattern(edges, &self.weights, &self.block, blocks);
        self.offsets = offsets(edges, &self.block, &self.pattern);
        self.solver = BlockSolver::new(&self.pattern, LinearSolver::Auto);
        self.values.resize(self.pattern.len(), 0.0);
        self.damped.resize(self.pattern.len(), 0.0);
        for (laid_out, weight) in self.laid_out.iter_mut().zip(&self.weights) {
            *laid_out = *weight > 0.0;
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
