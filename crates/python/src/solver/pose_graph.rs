//! `PoseGraph`: poses tied by relative measurements.

use super::graph::{Graph, Transform, edge_kind, graph_methods, transforms};
use super::{PySolverResult, Settings, square, vector3};
use crate::errors::{IntoPython, Kind, exception};
use crate::trajectory::pose_from;
use nalgebra::Matrix4;
use numpy::{PyArray1, PyArray3};
use pyo3::prelude::*;
use sphereflow_core::Pose;
use sphereflow_io::problems::{PoseGraphFile, read_g2o};
use sphereflow_sim::problems::{GraphKind, GraphSettings, graph};
use sphereflow_solver::graph::PoseGraph;
use std::path::PathBuf;

/// Poses (world from body) tied by relative measurements.
///
/// Informations are of [omega, v] in the body frame of the second pose; residuals are
/// log(measured^-1 from^-1 to).
#[pyclass(name = "PoseGraph", module = "sphereflow.solver")]
pub struct PyPoseGraph {
    graph: Graph<Pose, 6>,
    file: Option<PoseGraphFile>,
    truth: Vec<Pose>,
}

impl PyPoseGraph {
    fn made(graph: PoseGraph<Pose, 6>) -> Self {
        Self {
            graph: Graph::Made(graph),
            file: None,
            truth: Vec::new(),
        }
    }
}

impl Transform<6> for Pose {
    fn from_python(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
        pose_from(value, name)
    }

    fn to_matrix(self) -> Matrix4<f64> {
        self.matrix()
    }
}

graph_methods!(PyPoseGraph, "PoseGraph", {
    #[new]
    fn new() -> Self {
        Self::made(PoseGraph::new())
    }

    /// Read a g2o file (VERTEX_SE3:QUAT, EDGE_SE3:QUAT, FIX).
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        let file = read_g2o(&path).into_python()?;
        Ok(Self {
            file: Some(file.clone()),
            ..Self::made(file.graph)
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
            truth: made.truth,
            ..Self::made(made.graph)
        })
    }

    /// Write a graph that was read, with its nodes where they are now.
    fn write(&self, path: PathBuf) -> PyResult<()> {
        let Some(file) = &self.file else {
            let text = "write: expected a graph that was read from a file, found one made here";
            return Err(exception(Kind::Value, text));
        };
        let mut file = file.clone();
        file.graph = self.graph.graph().clone();
        file.write(&path).into_python()
    }

    /// What the file that was read holds that does not act on the poses, counted.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        let warnings = self.file.as_ref().map(PoseGraphFile::warnings);
        let all = warnings.map_or(&[][..], sphereflow_io::Warnings::as_slice);
        all.iter().map(ToString::to_string).collect()
    }

    /// True nodes of a generated graph (N, 4, 4); none otherwise.
    #[getter]
    fn truth<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        transforms(py, &self.truth)
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
        let graph = self.graph.graph();
        let (first, second) = graph.edges().map(|(a, b)| (a as i64, b as i64)).unzip();
        let measured: Vec<Pose> = graph.measured().copied().collect();
        Ok((
            PyArray1::from_vec(py, first),
            PyArray1::from_vec(py, second),
            transforms(py, &measured)?,
        ))
    }
});
