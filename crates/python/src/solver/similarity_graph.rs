//! `SimilarityGraph`: a pose graph whose nodes have a scale, for maps made from colour alone.

use super::{PySolverResult, Settings, edge_kind, square, vector3};
use crate::arrays::floats;
use crate::errors::{IntoPython, Kind, exception};
use crate::trajectory::pose_from;
use nalgebra::Matrix4;
use numpy::{PyArray1, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use sphereflow_core::Pose;
use sphereflow_solver::graph::{PoseGraph, Similarity};
use std::time::Duration;

/// A similarity from a (4, 4) array whose rotation block is a rotation times the scale.
fn similarity_from(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Similarity> {
    let array = floats(value, name, &[Some(4), Some(4)])?;
    let mut matrix = Matrix4::from_row_slice(array.as_slice()?);
    let scale = matrix.fixed_view::<3, 3>(0, 0).determinant().cbrt();
    if !(scale.is_finite() && scale > 0.0) {
        let text = format!("{name}: expected a positive scale, found {scale}");
        return Err(exception(Kind::Value, text));
    }
    for entry in &mut matrix.fixed_view_mut::<3, 3>(0, 0) {
        *entry /= scale;
    }
    let pose = Pose::from_matrix(&matrix);
    let pose = pose.map_err(|e| exception(Kind::Value, format!("{name}: {e}")))?;
    Ok(Similarity::new(pose, scale))
}

/// Similarities (world from body) tied by relative measurements: transforms (4, 4) whose rotation
/// block is a rotation times a scale.
///
/// Informations are (7, 7), of [omega, v, sigma] in the frame of the second node, sigma the logarithm
/// of the scale.
#[pyclass(name = "SimilarityGraph", module = "sphereflow.solver")]
pub struct PySimilarityGraph {
    graph: PoseGraph<Similarity, 7>,
}

#[pymethods]
impl PySimilarityGraph {
    #[new]
    fn new() -> Self {
        Self {
            graph: PoseGraph::new(),
        }
    }

    /// A node (4, 4), world from body; returns its index.
    #[pyo3(signature = (world_from_body, *, fixed = false))]
    fn add_node(&mut self, world_from_body: &Bound<'_, PyAny>, fixed: bool) -> PyResult<usize> {
        let pose = similarity_from(world_from_body, "world_from_body")?;
        let node = self.graph.add_node(pose).into_python()?;
        if fixed {
            self.graph.fix_node(node).into_python()?;
        }
        Ok(node)
    }

    /// A relative measurement (4, 4), first node from second, with its information (7, 7).
    #[pyo3(signature = (first, second, first_from_second, information, *, loop_closure = false))]
    fn add_edge(
        &mut self,
        first: usize,
        second: usize,
        first_from_second: &Bound<'_, PyAny>,
        information: &Bound<'_, PyAny>,
        loop_closure: bool,
    ) -> PyResult<usize> {
        let measured = similarity_from(first_from_second, "first_from_second")?;
        let information = square(information, "information")?;
        let kind = edge_kind(loop_closure);
        self.graph
            .add_edge((first, second), measured, &information, kind)
            .into_python()
    }

    /// What is known of a node (4, 4), with its information (7, 7).
    fn add_prior(
        &mut self,
        node: usize,
        world_from_body: &Bound<'_, PyAny>,
        information: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let known = similarity_from(world_from_body, "world_from_body")?;
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

    /// Nodes (N, 4, 4), world from body, rotation blocks times their scales.
    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let mut values = Vec::new();
        for node in self.graph.nodes() {
            let mut matrix = node.pose.matrix();
            for entry in &mut matrix.fixed_view_mut::<3, 3>(0, 0) {
                *entry *= node.scale;
            }
            values.extend(matrix.transpose().iter());
        }
        PyArray1::from_vec(py, values).reshape([self.graph.nodes().len(), 4, 4])
    }

    fn __repr__(&self) -> String {
        let (nodes, edges) = (self.graph.nodes().len(), self.graph.edges().count());
        format!("SimilarityGraph({nodes} nodes, {edges} edges)")
    }
}
