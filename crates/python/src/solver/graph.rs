//! What the graphs of poses and of similarities share: their state, and the methods of their classes.

use super::{PySolverResult, Settings};
use crate::errors::IntoPython;
use nalgebra::Matrix4;
use numpy::{PyArray1, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use sphereflow_solver::graph::{EdgeKind, GraphOptimiser, Group, LoopSwitch, PoseGraph};
use std::time::Instant;

/// A transform that goes to and from (4, 4) arrays.
pub trait Transform<const D: usize>: Group<D> {
    /// From an array; errors name the argument.
    fn from_python(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Self>;
    /// The homogeneous matrix.
    fn to_matrix(self) -> Matrix4<f64>;
}

/// A graph while it is made, or laid out for its minimisation: solving again, from other nodes too,
/// keeps the layout until an edge or a node is added.
pub enum Graph<G, const D: usize> {
    Made(PoseGraph<G, D>),
    LaidOut(Box<GraphOptimiser<G, D>>),
}

impl<G: Transform<D>, const D: usize> Graph<G, D> {
    pub fn graph(&self) -> &PoseGraph<G, D> {
        match self {
            Self::Made(graph) => graph,
            Self::LaidOut(optimiser) => optimiser.graph(),
        }
    }

    /// To change its structure: what was laid out is forgotten.
    pub fn edit(&mut self) -> PyResult<&mut PoseGraph<G, D>> {
        if let Self::LaidOut(_) = self {
            let empty = Self::Made(PoseGraph::new());
            if let Self::LaidOut(optimiser) = std::mem::replace(self, empty) {
                *self = Self::Made(optimiser.into_graph());
            }
        }
        match self {
            Self::Made(graph) => Ok(graph),
            Self::LaidOut(_) => Err(pyo3::exceptions::PyRuntimeError::new_err("no graph")),
        }
    }

    fn lay_out(&mut self) -> Option<&mut GraphOptimiser<G, D>> {
        if let Self::Made(graph) = self {
            let optimiser = GraphOptimiser::new(std::mem::take(graph));
            *self = Self::LaidOut(Box::new(optimiser));
        }
        match self {
            Self::LaidOut(optimiser) => Some(optimiser),
            Self::Made(_) => None,
        }
    }

    pub fn add_node(&mut self, value: &Bound<'_, PyAny>, fixed: bool) -> PyResult<usize> {
        let pose = G::from_python(value, "world_from_body")?;
        let graph = self.edit()?;
        let node = graph.add_node(pose).into_python()?;
        if fixed {
            graph.fix_node(node).into_python()?;
        }
        Ok(node)
    }

    /// All nodes elsewhere, the layout kept.
    pub fn set_nodes(&mut self, nodes: &Bound<'_, PyAny>) -> PyResult<()> {
        let mut all = Vec::with_capacity(self.graph().nodes().len());
        for node in nodes.try_iter()? {
            all.push(G::from_python(&node?, "nodes")?);
        }
        let Some(optimiser) = self.lay_out() else {
            return Ok(());
        };
        optimiser.restart(&all).into_python()
    }

    pub fn solve(
        &mut self,
        py: Python<'_>,
        switch: LoopSwitch,
        settings: &Settings,
    ) -> PyResult<PySolverResult> {
        let begin = Instant::now();
        let work = || (self.lay_out()).map(|optimiser| optimiser.solve(switch, &settings.options));
        let Some(summary) = settings.run(py, work)? else {
            return Err(pyo3::exceptions::PyRuntimeError::new_err("no graph"));
        };
        let summary = summary.into_python()?;
        Ok(PySolverResult {
            issues: summary.issues.iter().map(ToString::to_string).collect(),
            linear_solver: None,
            rejected: summary.robust.rejected,
            setup: begin.elapsed().saturating_sub(summary.summary.elapsed),
            summary: summary.summary,
        })
    }

    pub fn describe(&self, name: &str) -> String {
        let (nodes, edges) = (self.graph().nodes().len(), self.graph().edges().count());
        format!("{name}({nodes} nodes, {edges} edges)")
    }
}

/// Transforms as an array (N, 4, 4).
pub fn transforms<'py, G: Transform<D>, const D: usize>(
    py: Python<'py>,
    all: &[G],
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let values = all.iter().map(|one| one.to_matrix().transpose());
    let values: Vec<f64> = values.flat_map(|matrix| matrix.data.0.concat()).collect();
    PyArray1::from_vec(py, values).reshape([all.len(), 4, 4])
}

/// What a loop edge is, and others.
pub fn edge_kind(loop_closure: bool) -> EdgeKind {
    if loop_closure {
        EdgeKind::Loop
    } else {
        EdgeKind::Odometry
    }
}

/// The methods of a graph's class, with those that it has alone: a class has one block of methods, and
/// none that is generic. The class is a struct with `graph: Graph<_, _>`.
macro_rules! graph_methods {
    ($class:ident, $name:literal, { $($own:tt)* }) => {
        #[pymethods]
        impl $class {
            $($own)*

            /// A node (4, 4), world from body; returns its index.
            #[pyo3(signature = (world_from_body, *, fixed = false))]
            fn add_node(
                &mut self,
                world_from_body: &Bound<'_, PyAny>,
                fixed: bool,
            ) -> PyResult<usize> {
                self.graph.add_node(world_from_body, fixed)
            }

            /// A relative measurement (4, 4), first node from second, with its information: (6, 6)
            /// of poses, (7, 7) of similarities.
            #[pyo3(signature = (first, second, first_from_second, information, *,
                loop_closure = false))]
            fn add_edge(
                &mut self,
                first: usize,
                second: usize,
                first_from_second: &Bound<'_, PyAny>,
                information: &Bound<'_, PyAny>,
                loop_closure: bool,
            ) -> PyResult<usize> {
                let measured = Transform::from_python(first_from_second, "first_from_second")?;
                let information = square(information, "information")?;
                let kind = edge_kind(loop_closure);
                let graph = self.graph.edit()?;
                let added = graph.add_edge((first, second), measured, &information, kind);
                added.into_python()
            }

            /// What is known of a node (4, 4), with its information as of edges.
            fn add_prior(
                &mut self,
                node: usize,
                world_from_body: &Bound<'_, PyAny>,
                information: &Bound<'_, PyAny>,
            ) -> PyResult<()> {
                let known = Transform::from_python(world_from_body, "world_from_body")?;
                let information = square(information, "information")?;
                let added = self.graph.edit()?.add_prior(node, known, &information);
                added.into_python()
            }

            /// A direction of the world (3,), gravity say, as it was measured in the body frame (3,).
            #[pyo3(signature = (node, world, body, *, sigma_rad))]
            fn add_gravity(
                &mut self,
                node: usize,
                world: &Bound<'_, PyAny>,
                body: &Bound<'_, PyAny>,
                sigma_rad: f64,
            ) -> PyResult<()> {
                let (world, body) = (vector3(world, "world")?, vector3(body, "body")?);
                let graph = self.graph.edit()?;
                graph.add_gravity(node, &world, &body, sigma_rad).into_python()
            }

            /// The turn about a direction of the world (3,), the vertical say, is that of a pose (4, 4).
            #[pyo3(signature = (node, axis, world_from_body, *, sigma_rad))]
            fn add_yaw(
                &mut self,
                node: usize,
                axis: &Bound<'_, PyAny>,
                world_from_body: &Bound<'_, PyAny>,
                sigma_rad: f64,
            ) -> PyResult<()> {
                let axis = vector3(axis, "axis")?;
                let known = pose_from(world_from_body, "world_from_body")?.rotation;
                let graph = self.graph.edit()?;
                graph.add_yaw(node, &axis, &known, sigma_rad).into_python()
            }

            /// Start from other nodes (N, 4, 4), given for all of them; what was laid out stays.
            fn set_nodes(&mut self, nodes: &Bound<'_, PyAny>) -> PyResult<()> {
                self.graph.set_nodes(nodes)
            }

            /// Minimise from the present state on, in place; Ctrl-C ends it after the iteration under
            /// way. Solving again keeps the layout (order of elimination, room for the factor) until
            /// something is added.
            ///
            /// Parameters
            /// ----------
            /// switch : {'off', 'gnc', 'dcs'}
            ///     How wrong loop edges are told: not at all, by graduated non-convexity, or by
            ///     dynamic covariance scaling.
            /// threshold : float
            ///     Squared whitened residual from which a loop is doubted; 16.8 is 99 % of 6 degrees.
            #[pyo3(signature = (*, switch = "off", threshold = 16.8, max_iterations = 100,
                function_tolerance = 1e-6, parameter_tolerance = 1e-8, time_budget_s = None,
                threads = 0))]
            #[allow(clippy::too_many_arguments)]
            fn solve(
                &mut self,
                py: Python<'_>,
                switch: &str,
                threshold: f64,
                max_iterations: usize,
                function_tolerance: f64,
                parameter_tolerance: f64,
                time_budget_s: Option<f64>,
                threads: usize,
            ) -> PyResult<PySolverResult> {
                let switch = crate::solver::switch(switch, threshold)?;
                let tolerances = [function_tolerance, parameter_tolerance];
                let settings = Settings::new(max_iterations, tolerances, time_budget_s, threads)?;
                self.graph.solve(py, switch, &settings)
            }

            /// Nodes (N, 4, 4), world from body; of similarities rotation blocks times their scales.
            #[getter]
            fn nodes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
                transforms(py, self.graph.graph().nodes())
            }

            fn __repr__(&self) -> String {
                self.graph.describe($name)
            }
        }
    };
}

pub(super) use graph_methods;
