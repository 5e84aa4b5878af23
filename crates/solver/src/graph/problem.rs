//! The pose graph as it is stated: nodes, relative measurements, priors.

use super::group::Group;
use super::prior::Prior;
use crate::{Error, Loss, Result};
use nalgebra::{SMatrix, Unit, UnitQuaternion, Vector3};
use sphereflow_core::Pose;
use sphereflow_core::checks::positive;
use std::fmt;

/// Whether a relative measurement can be wrong as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EdgeKind {
    /// Between neighbours in time: believed.
    Odometry,
    /// A recognised place: subject to the robust switch.
    Loop,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Edge<G, const D: usize> {
    pub from: usize,
    pub to: usize,
    /// `from_from_to`.
    pub measured: G,
    pub root: SMatrix<f64, D, D>,
    pub kind: EdgeKind,
    pub loss: Loss,
}

impl<G, const D: usize> Edge<G, D> {
    /// What decides how much a residual counts.
    pub fn by(&self) -> (EdgeKind, Loss) {
        (self.kind, self.loss)
    }
}

/// Poses `world_from_body` tied by relative measurements. Updates are from the right,
/// `T <- T exp(d)`, and residuals are `log(measured^-1 from^-1 to)`; covariances and informations
/// are of tangent vectors `[omega, v]` (similarities: `[omega, v, sigma]`) in the body frame of
/// the second pose.
#[derive(Clone, Debug)]
pub struct PoseGraph<G, const D: usize> {
    pub(super) nodes: Vec<G>,
    pub(super) fixed: Vec<bool>,
    pub(super) edges: Vec<Edge<G, D>>,
    pub(super) priors: Vec<Prior<G, D>>,
}

/// Something the measurements of a graph do not determine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum GraphIssue {
    /// The graph falls into parts that no edge ties.
    Disconnected {
        /// Number of parts.
        parts: usize,
    },
    /// Nothing fixes a part in the world: its first node was held where it is.
    Held {
        /// The node.
        node: usize,
    },
}

impl fmt::Display for GraphIssue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Disconnected { parts } => {
                write!(f, "the graph falls into {parts} parts that no edge ties")
            }
            Self::Held { node } => {
                write!(
                    f,
                    "nothing fixes the part of node {node}: that node was held"
                )
            }
        }
    }
}

impl<G: Group<D>, const D: usize> Default for PoseGraph<G, D> {
    fn default() -> Self {
        Self::new()
    }
}

impl<G: Group<D>, const D: usize> PoseGraph<G, D> {
    /// Without anything in it.
    pub fn new() -> Self {
        Self {
            nodes: Vec::new(),
            fixed: Vec::new(),
            edges: Vec::new(),
            priors: Vec::new(),
        }
    }

    /// A node at its start, world from body.
    ///
    /// # Errors
    /// Where it is not finite.
    pub fn add_node(&mut self, world_from_body: G) -> Result<usize> {
        valid("world_from_body", &world_from_body)?;
        self.nodes.push(world_from_body);
        self.fixed.push(false);
        Ok(self.nodes.len() - 1)
    }

    /// Hold a node where it is.
    ///
    /// # Errors
    /// Where there is no such node.
    pub fn fix_node(&mut self, node: usize) -> Result<()> {
        self.known("node", node)?;
        self.fixed[node] = true;
        Ok(())
    }

    /// A relative measurement `from_from_to` with its information.
    ///
    /// # Errors
    /// Where a node is unknown or both are the same, a number is not finite, or the information is
    /// not positive definite.
    pub fn add_edge(
        &mut self,
        (from, to): (usize, usize),
        measured: G,
        information: &SMatrix<f64, D, D>,
        kind: EdgeKind,
    ) -> Result<usize> {
        self.known("from", from)?;
        self.known("to", to)?;
        if from == to {
            return Err(Error::value("to", "another node than `from`", to));
        }
        valid("measured", &measured)?;
        let root = root("information", information)?;
        self.edges.push(Edge {
            from,
            to,
            measured,
            root,
            kind,
            loss: Loss::Quadratic,
        });
        Ok(self.edges.len() - 1)
    }

    /// A relative measurement `a_from_b` as an alignment of images gives it: its information is of
    /// tangent vectors in the frame of `a`, and large residuals count by `loss` (where no switch
    /// decides). The residual is `log(a^-1 b measured^-1)`; as `log(measured^-1 a^-1 b)` is that by
    /// the adjoint of `measured`, the information of [`PoseGraph::add_edge`] is
    /// `Ad(measured)^T information Ad(measured)`, exactly.
    ///
    /// # Errors
    /// As for [`PoseGraph::add_edge`], or where the loss has no positive threshold.
    pub fn add_alignment(
        &mut self,
        (a, b): (usize, usize),
        a_from_b: G,
        information: &SMatrix<f64, D, D>,
        loss: Loss,
    ) -> Result<usize> {
        loss.check()?;
        valid("measured", &a_from_b)?;
        let to_a = a_from_b.adjoint();
        let in_b = to_a.tr_mul(&(information * to_a));
        // rounding of the products is not asymmetry
        let in_b = (in_b + in_b.transpose()) * 0.5;
        root("information", information)?;
        let edge = self.add_edge((a, b), a_from_b, &in_b, EdgeKind::Odometry)?;
        self.edges[edge].loss = loss;
        Ok(edge)
    }

    /// What is known of a node, with its information.
    ///
    /// # Errors
    /// Where the node is unknown, a number is not finite, or the information is not positive definite.
    pub fn add_prior(
        &mut self,
        node: usize,
        world_from_body: G,
        information: &SMatrix<f64, D, D>,
    ) -> Result<()> {
        self.known("node", node)?;
        valid("world_from_body", &world_from_body)?;
        let root = root("information", information)?;
        self.priors.push(Prior::Whole {
            node,
            inverse: world_from_body.inverse(),
            root,
        });
        Ok(())
    }

    /// The direction `world` of the world frame was measured as `body` in the body frame (gravity,
    /// say), with a standard deviation in radians.
    ///
    /// # Errors
    /// Where the node is unknown, or a number is not finite or zero.
    pub fn add_gravity(
        &mut self,
        node: usize,
        world: &Vector3<f64>,
        body: &Vector3<f64>,
        sigma_rad: f64,
    ) -> Result<()> {
        self.known("node", node)?;
        let (world, body) = (direction("world", world)?, direction("body", body)?);
        positive("sigma_rad", sigma_rad)?;
        let root = 1.0 / sigma_rad;
        self.priors.push(Prior::Gravity {
            node,
            world,
            body,
            root,
        });
        Ok(())
    }

    /// The turn about the direction `axis` of the world frame (the vertical, say) is that of
    /// `world_from_body`, with a standard deviation in radians.
    ///
    /// # Errors
    /// Where the node is unknown, or a number is not finite or zero.
    pub fn add_yaw(
        &mut self,
        node: usize,
        axis: &Vector3<f64>,
        world_from_body: &UnitQuaternion<f64>,
        sigma_rad: f64,
    ) -> Result<()> {
        self.known("node", node)?;
        valid(
            "world_from_body",
            &Pose::new(*world_from_body, Vector3::zeros()),
        )?;
        let axis = direction("axis", axis)?;
        positive("sigma_rad", sigma_rad)?;
        let root = 1.0 / sigma_rad;
        self.priors.push(Prior::Yaw {
            node,
            axis,
            known: *world_from_body,
            root,
        });
        Ok(())
    }

    /// The nodes, world from body.
    pub fn nodes(&self) -> &[G] {
        &self.nodes
    }

    /// The ends of the edges: from and to.
    pub fn edges(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.edges.iter().map(|edge| (edge.from, edge.to))
    }

    /// The relative measurements of the edges, `from_from_to`.
    pub fn measured(&self) -> impl Iterator<Item = &G> + '_ {
        self.edges.iter().map(|edge| &edge.measured)
    }

    /// Move a node: a new start.
    ///
    /// # Errors
    /// Where there is no such node, or the new place is not finite.
    pub fn set_node(&mut self, node: usize, world_from_body: G) -> Result<()> {
        self.known("node", node)?;
        valid("world_from_body", &world_from_body)?;
        self.nodes[node] = world_from_body;
        Ok(())
    }

    /// Put every node where the odometry edges lead from the first on; nodes they do not reach stay.
    pub fn chain_odometry(&mut self) {
        for edge in &self.edges {
            if edge.kind == EdgeKind::Odometry && edge.from < edge.to && !self.fixed[edge.to] {
                self.nodes[edge.to] = self.nodes[edge.from].compose(&edge.measured);
            }
        }
    }

    fn known(&self, argument: &str, node: usize) -> Result<()> {
        let count = self.nodes.len();
        if node < count {
            return Ok(());
        }
        Err(Error::value(
            argument,
            format!("an index below {count}"),
            node,
        ))
    }

    /// Parts of the graph, and the nodes to hold because nothing else fixes their part.
    pub(super) fn gauge(&self) -> (Vec<usize>, Vec<GraphIssue>) {
        let mut part: Vec<usize> = (0..self.nodes.len()).collect();
        let root = |part: &mut Vec<usize>, mut node: usize| {
            while part[node] != node {
                part[node] = part[part[node]];
                node = part[node];
            }
            node
        };
        for edge in &self.edges {
            let (a, b) = (root(&mut part, edge.from), root(&mut part, edge.to));
            part[a.max(b)] = a.min(b);
        }
        let mut held = vec![false; self.nodes.len()];
        for node in (0..self.nodes.len()).filter(|&node| self.fixed[node]) {
            held[root(&mut part, node)] = true;
        }
        for prior in &self.priors {
            if let Prior::Whole { node, .. } = prior {
                held[root(&mut part, *node)] = true;
            }
        }
        let roots: Vec<usize> = (0..self.nodes.len())
            .filter(|&node| part[node] == node)
            .collect();
        let mut issues = Vec::new();
        if roots.len() > 1 {
            issues.push(GraphIssue::Disconnected { parts: roots.len() });
        }
        let hold: Vec<usize> = roots.into_iter().filter(|&node| !held[node]).collect();
        issues.extend(hold.iter().map(|&node| GraphIssue::Held { node }));
        (hold, issues)
    }
}

fn valid<G: Group<D>, const D: usize>(argument: &str, value: &G) -> Result<()> {
    if value.is_valid() {
        return Ok(());
    }
    Err(Error::value(
        argument,
        "finite numbers",
        format!("{value:?}"),
    ))
}

fn direction(argument: &str, value: &Vector3<f64>) -> Result<Vector3<f64>> {
    let found = format!("{:?}", value.as_slice());
    let refuse = || Error::value(argument, "a direction", found);
    let finite = value.iter().all(|v| v.is_finite());
    let unit = Unit::try_new(*value, 1e-12).filter(|_| finite);
    Ok(unit.ok_or_else(refuse)?.into_inner())
}

/// The root `L^T` of an information `L L^T`.
fn root<const D: usize>(argument: &str, matrix: &SMatrix<f64, D, D>) -> Result<SMatrix<f64, D, D>> {
    let scale = matrix.abs().max();
    // files print about 6 digits of each triangle
    let even = (matrix - matrix.transpose()).abs().max() <= 1e-5 * scale;
    let factor = matrix.cholesky().filter(|_| even && scale.is_finite());
    let expected = "a symmetric positive definite matrix of finite numbers";
    let refuse = || Error::value(argument, expected, matrix);
    Ok(factor.ok_or_else(refuse)?.l().transpose())
}
