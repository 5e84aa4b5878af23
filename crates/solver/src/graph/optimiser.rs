//! A pose graph laid out once, then solved as often as wanted.

use super::group::Group;
use super::problem::{GraphIssue, PoseGraph};
use super::robust::{LoopSwitch, RobustSummary, graduate, judge};
use super::solve::GraphState;
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
    state: GraphState<G, D>,
    issues: Vec<GraphIssue>,
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
        Self {
            state: GraphState::new(graph, &hold),
            issues,
        }
    }

    /// The graph in its present state.
    pub fn graph(&self) -> &PoseGraph<G, D> {
        &self.state.graph
    }

    /// The graph in its present state.
    pub fn into_graph(self) -> PoseGraph<G, D> {
        self.state.graph
    }

    /// Start from other nodes, given for all of them.
    ///
    /// # Errors
    /// Where their number is wrong, or a number is not finite.
    pub fn restart(&mut self, nodes: &[G]) -> Result<()> {
        let expected = self.state.graph.nodes.len();
        if nodes.len() != expected {
            return Err(Error::value("nodes", expected, nodes.len()));
        }
        for (node, world_from_body) in nodes.iter().enumerate() {
            self.state.graph.set_node(node, *world_from_body)?;
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
        self.state.begin(switch);
        let (summary, robust) = match switch {
            LoopSwitch::Graduated { threshold } => graduate(&mut self.state, threshold, options)?,
            _ => {
                let summary = minimise(&mut self.state, options)?;
                (summary, judge(&mut self.state))
            }
        };
        Ok(GraphSummary {
            summary,
            issues: self.issues.clone(),
            robust,
        })
    }
}
