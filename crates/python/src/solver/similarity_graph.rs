//! `SimilarityGraph`: a pose graph whose nodes have a scale, for maps made from colour alone.

use super::graph::{Graph, Transform, edge_kind, graph_methods, transforms};
use super::{PySolverResult, Settings, square, vector3};
use crate::arrays::floats;
use crate::errors::{IntoPython, Kind, exception};
use crate::trajectory::pose_from;
use nalgebra::Matrix4;
use numpy::PyArray3;
use pyo3::prelude::*;
use sphereflow_core::Pose;
use sphereflow_solver::graph::{PoseGraph, Similarity};

impl Transform<7> for Similarity {
    /// The rotation block of the array is a rotation times the scale.
    fn from_python(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
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

    fn to_matrix(self) -> Matrix4<f64> {
        let mut matrix = self.pose.matrix();
        for entry in &mut matrix.fixed_view_mut::<3, 3>(0, 0) {
            *entry *= self.scale;
        }
        matrix
    }
}

/// Similarities (world from body) tied by relative measurements: transforms (4, 4) whose rotation
/// block is a rotation times a scale.
///
/// Informations are (7, 7), of [omega, v, sigma] in the frame of the second node, sigma the logarithm
/// of the scale.
#[pyclass(name = "SimilarityGraph", module = "sphereflow.solver")]
pub struct PySimilarityGraph {
    graph: Graph<Similarity, 7>,
}

graph_methods!(PySimilarityGraph, "SimilarityGraph", {
    #[new]
    fn new() -> Self {
        Self {
            graph: Graph::Made(PoseGraph::new()),
        }
    }
});
