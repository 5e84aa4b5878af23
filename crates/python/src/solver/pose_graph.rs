//! `PoseGraph`: poses tied by relative measurements.

use super::{PySolverResult, Settings, edge_kind, matrices, square, vector3};
use crate::errors::{IntoPython, Kind, exception};
use crate::trajectory::pose_from;
use numpy::{PyArray1, PyArray3};
use pyo3::prelude::*;
use sphereflow_core::Pose;
use sphereflow_io::problems::{PoseGraphFile, read_g2o};
use sphereflow_solver::generate::{GraphKind, GraphSettings, graph};
use sphereflow_solver::graph::PoseGraph;
use std::path::PathBuf;
use std::time::Duration;

/// Poses (world from body) tied by relative measurements.
///
/// Informations are of [omega, v] in the body frame of the second pose; residuals are
/// log(measured^-1 from^-1 to).
#[pyclass(name = "PoseGraph", module = "sphereflow.solver")]
pub struct PyPoseGraph {
    graph: PoseGraph<Pose, 6>,
    file: Option<PoseGraphFile>,
    truth: Vec<Pose>,
}

#[pymethods]
impl PyPoseGraph {
    #[new]
    fn new() -> Self {
        Self {
            graph: PoseGraph::new(),
            file: None,
            truth: Vec::new(),
        }
    }

    /// Read a g2o file (VERTEX_SE3:QUAT, EDGE_SE3:QUAT, FIX).
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        let file = read_g2o(&path).into_python()?;
        Ok(Self {
            graph: file.graph.clone(),
            file: Some(file),
            truth: Vec::new(),
        })
    }

    /// A seeded graph with a known truth: odometry along a path that winds around a surface, loops
    /// to the ring before, and a share of wrong loops. The first node is fixed.
    #[staticmethod]
    #[pyo3(signature = (kind, rings, ring, *, wrong_loops = 0.0, seed = 0))]
    fn generate(
        kind: &str,
        rings: usize,
        ring: usize,
        wrong_loops: f64,
        seed: u64,
    ) -> PyResult<Self> {
        let kind = match kind {
            "sphere" => GraphKind::Sphere,
            "torus" => GraphKind::Torus,
            "grid" => GraphKind::Grid,
            other => {
                let text = format!("kind: expected 'sphere', 'torus' or 'grid', found '{other}'");
                return Err(exception(Kind::Value, text));
            }
        };
        let settings = GraphSettings {
            wrong_loops,
            ..GraphSettings::new(kind, rings, ring, seed)
        };
        let made = graph(&settings).into_python()?;
        Ok(Self {
            graph: made.graph,
            file: None,
            truth: made.truth,
        })
    }

    /// Write a graph that was read, with its nodes where they are now.
    fn write(&self, path: PathBuf) -> PyResult<()> {
        let Some(file) = &self.file else {
            let text = "write: expected a graph that was read from a file, found one made here";
            return Err(exception(Kind::Value, text));
        };
        let mut file = file.clone();
        file.graph = self.graph.clone();
        file.write(&path).into_python()
    }

    /// A node (4, 4), world from body; returns its index.
    #[pyo3(signature = (world_from_body, *, fixed = false))]
    fn add_node(&mut self, world_from_body: &Bound<'_, PyAny>, fixed: bool) -> PyResult<usize> {
        let pose = pose_from(world_from_body, "world_from_body")?;
        let node = self.graph.add_node(pose).into_python()?;
        if fixed {
            self.graph.fix_node(node).into_python()?;
        }
        Ok(node)
    }

    /// A relative measurement (4, 4), first node from second, with its information (6, 6).
    #[pyo3(signature = (first, second, first_from_second, information, *, loop_closure = false))]
    fn add_edge(
        &mut self,
        first: usize,
        second: usize,
        first_from_second: &Bound<'_, PyAny>,
        information: &Bound<'_, PyAny>,
        loop_closure: bool,
    ) -> PyResult<usize> {
        let measured = pose_from(first_from_second, "first_from_second")?;
        let kind = edge_kind(loop_closure);
        let information = square(information, "information")?;
        self.graph
            .add_edge((first, second), measured, &information, kind)
            .into_python()
    }

    /// What is known of a node (4, 4), with its information (6, 6).
    fn add_prior(
        &mut self,
        node: usize,
        world_from_body: &Bound<'_, PyAny>,
        information: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let known = pose_from(world_from_body, "world_from_body")?;
        let information = square(information, "information")?;
        let added = self.graph.add_prior(node, known, &information);
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
        let added = self.graph.add_gravity(node, &world, &body, sigma_rad);
        added.into_python()
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
        let added = self.graph.add_yaw(node, &axis, &known, sigma_rad);
        added.into_python()
    }

    /// Minimise from the present state on, in place; Ctrl-C ends it after the iteration under way.
    ///
    /// Parameters
    /// ----------
    /// switch : {'off', 'gnc', 'dcs'}
    ///     How wrong loop edges are told: not at all, by graduated non-convexity, or by dynamic
    ///     covariance scaling.
    /// threshold : float
    ///     Squared whitened residual from which a loop is doubted; 16.8 is 99 % of 6 degrees.
    #[pyo3(signature = (*, switch = "off", threshold = 16.8, max_iterations = 100,
        function_tolerance = 1e-6, parameter_tolerance = 1e-8, time_budget_s = None, threads = 0))]
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
        let switch = super::switch(switch, threshold)?;
        let settings = Settings::new(
            max_iterations,
            function_tolerance,
            parameter_tolerance,
            time_budget_s,
            threads,
        )?;
        let graph = &mut self.graph;
        let begin = std::time::Instant::now();
        let summary = settings
            .run(py, || graph.solve(switch, &settings.options))?
            .into_python()?;
        let setup = begin.elapsed().saturating_sub(summary.summary.elapsed);
        Ok(PySolverResult {
            issues: summary.issues.iter().map(ToString::to_string).collect(),
            linear_solver: None,
            rejected: summary.robust.rejected,
            setup: setup.max(Duration::ZERO),
            summary: summary.summary,
        })
    }

    /// Nodes (N, 4, 4), world from body.
    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        matrices(py, self.graph.nodes().iter().copied())
    }

    /// True nodes of a generated graph (N, 4, 4); none otherwise.
    #[getter]
    fn truth<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        matrices(py, self.truth.iter().copied())
    }

    /// Edges: first nodes (M,), second nodes (M,), measurements (M, 4, 4).
    #[getter]
    #[allow(clippy::type_complexity)]
    fn edges<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(
        Bound<'py, PyArray1<i64>>,
        Bound<'py, PyArray1<i64>>,
        Bound<'py, PyArray3<f64>>,
    )> {
        let (mut first, mut second) = (Vec::new(), Vec::new());
        for (from, to) in self.graph.edges() {
            first.push(from as i64);
            second.push(to as i64);
        }
        Ok((
            PyArray1::from_vec(py, first),
            PyArray1::from_vec(py, second),
            matrices(py, self.graph.measured().copied())?,
        ))
    }

    fn __repr__(&self) -> String {
        let (nodes, edges) = (self.graph.nodes().len(), self.graph.edges().count());
        format!("PoseGraph({nodes} nodes, {edges} edges)")
    }
}
