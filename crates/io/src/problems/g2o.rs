//! g2o's pose graphs in three dimensions: text.
//!
//! `VERTEX_SE3:QUAT id x y z qx qy qz qw`, `EDGE_SE3:QUAT from to x y z qx qy qz qw` with the upper
//! triangle of the information by rows, and `FIX id`. The file's order is translation, rotation; the
//! information of the rotation is taken for the rotation vector, as GTSAM takes it. Points
//! (`VERTEX_TRACKXYZ`, `EDGE_SE3_TRACKXYZ`, `PARAMS_SE3OFFSET`) do not move poses and follow them;
//! priors (`EDGE_SE3_PRIOR`) and other parameters are kept in the file and not used.

use super::landmarks::Landmarks;
use crate::beside::write_file;
use crate::rows::{Row, read_text, rows};
use crate::{Error, Result, Warnings};
use nalgebra::Matrix6;
use sphereflow_core::Pose;
use sphereflow_solver::graph::{EdgeKind, PoseGraph};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

/// A pose graph from a file.
#[derive(Clone, Debug)]
pub struct PoseGraphFile {
    /// The graph. Edges between neighbours in the order of the numbers are odometry, others loops.
    pub graph: PoseGraph<Pose, 6>,
    /// The file's numbers of the nodes.
    pub ids: Vec<u64>,
    /// The edges as they stand in the file, then what it fixes.
    edges: Vec<String>,
    /// Parameters, which come first in a file.
    parameters: Vec<String>,
    landmarks: Landmarks,
    /// What the file holds that does not act on the poses.
    warnings: Warnings,
}

/// Read a pose graph.
///
/// # Errors
/// Where the file cannot be read, or a line is not what it should be.
pub fn read_g2o(path: &Path) -> Result<PoseGraphFile> {
    let text = read_text(path)?;
    let mut vertices = BTreeMap::new();
    let (mut edges, mut fixed) = (Vec::new(), Vec::new());
    let (mut lines, mut parameters) = (Vec::new(), Vec::new());
    let mut landmarks = Landmarks::default();
    let mut warnings = Warnings::default();
    for row in rows(path, &text) {
        match row.text(0) {
            "VERTEX_SE3:QUAT" => {
                row.expect_columns(9, "tag, id, x y z qx qy qz qw")?;
                if vertices.insert(id(&row, 1)?, pose(&row, 2)?).is_some() {
                    return Err(row.error("every vertex once", row.text(1)));
                }
            }
            "EDGE_SE3:QUAT" => {
                row.expect_columns(31, "tag, from, to, x y z qx qy qz qw, 21 of information")?;
                edges.push(row);
            }
            "FIX" => {
                row.expect_columns(2, "tag, id")?;
                fixed.push(row);
            }
            tag if tag.starts_with("PARAMS_") => {
                landmarks.take(&row)?;
                parameters.push(row.fields.join(" "));
            }
            "VERTEX_TRACKXYZ" => {
                landmarks.take(&row)?;
            }
            "EDGE_SE3_TRACKXYZ" => {
                landmarks.take(&row)?;
                lines.push(row.fields.join(" "));
                warnings.add("measured points do not act on the poses", || line_of(&row));
            }
            "EDGE_SE3_PRIOR" => {
                lines.push(row.fields.join(" "));
                warnings.add("priors are kept and not used", || line_of(&row));
            }
            other => {
                let expected = "VERTEX_SE3:QUAT, EDGE_SE3:QUAT or FIX (2-D graphs are not read)";
                return Err(row.error(expected, format!("`{other}`")));
            }
        }
    }
    let ids: Vec<u64> = vertices.keys().copied().collect();
    let index = |row: &Row<'_>, column: usize| -> Result<usize> {
        let id = id(row, column)?;
        ids.binary_search(&id)
            .map_err(|_| row.error("the id of a vertex", id))
    };
    let mut graph = PoseGraph::new();
    for pose in vertices.into_values() {
        graph
            .add_node(pose)
            .map_err(|error| Error::content(path, "poses", error))?;
    }
    for row in &edges {
        let (from, to) = (index(row, 1)?, index(row, 2)?);
        let kind = if from.abs_diff(to) == 1 {
            EdgeKind::Odometry
        } else {
            EdgeKind::Loop
        };
        graph
            .add_edge((from, to), pose(row, 3)?, &information(row, 10)?, kind)
            .map_err(|error| row.error("an edge", error))?;
        lines.push(row.fields.join(" "));
    }
    for row in &fixed {
        let node = index(row, 1)?;
        graph
            .fix_node(node)
            .map_err(|error| row.error("a node", error))?;
        lines.push(format!("FIX {}", row.text(1)));
    }
    Ok(PoseGraphFile {
        graph,
        ids,
        edges: lines,
        parameters,
        landmarks,
        warnings,
    })
}

fn line_of(row: &Row<'_>) -> String {
    format!("line {}: {}", row.line, row.text(0))
}

impl PoseGraphFile {
    /// What the file holds that does not act on the poses, counted.
    pub fn warnings(&self) -> &Warnings {
        &self.warnings
    }

    /// Write the graph with its nodes where they are now.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let nodes = self.graph.nodes();
        let pose_of = |id| Some(nodes[self.ids.binary_search(&id).ok()?]);
        let points = self.landmarks.placed(pose_of);
        write_file(path, |file| {
            for line in &self.parameters {
                writeln!(file, "{line}").map_err(Error::system(path, "write"))?;
            }
            for (id, p) in &points {
                writeln!(file, "VERTEX_TRACKXYZ {id} {} {} {}", p.x, p.y, p.z)
                    .map_err(Error::system(path, "write"))?;
            }
            for (id, node) in self.ids.iter().zip(self.graph.nodes()) {
                let (t, [x, y, z, w]) = (node.translation, node.quat_xyzw());
                let line = format!("{} {} {} {x} {y} {z} {w}", t.x, t.y, t.z);
                writeln!(file, "VERTEX_SE3:QUAT {id} {line}")
                    .map_err(Error::system(path, "write"))?;
            }
            for edge in &self.edges {
                writeln!(file, "{edge}").map_err(Error::system(path, "write"))?;
            }
            Ok(())
        })
    }
}

/// Write poses, numbered from 0, and motions between them with their information, `[omega, v]` in the
/// frame of the second pose, as a g2o file (whose order is translation before rotation).
///
/// # Errors
/// Where the file cannot be written.
pub fn write_g2o(
    path: &Path,
    poses: impl Iterator<Item = Pose>,
    edges: impl Iterator<Item = (usize, usize, Pose, Matrix6<f64>)>,
) -> Result<()> {
    let numbers = |pose: &Pose| {
        let (t, [x, y, z, w]) = (pose.translation, pose.quat_xyzw());
        format!("{} {} {} {x} {y} {z} {w}", t.x, t.y, t.z)
    };
    write_file(path, |file| {
        for (id, pose) in poses.enumerate() {
            writeln!(file, "VERTEX_SE3:QUAT {id} {}", numbers(&pose))
                .map_err(Error::system(path, "write"))?;
        }
        for (from, to, motion, information) in edges {
            write!(file, "EDGE_SE3:QUAT {from} {to} {}", numbers(&motion))
                .map_err(Error::system(path, "write"))?;
            let moved = |k: usize| (k + 3) % 6;
            for i in 0..6 {
                for j in i..6 {
                    write!(file, " {}", information[(moved(i), moved(j))])
                        .map_err(Error::system(path, "write"))?;
                }
            }
            writeln!(file).map_err(Error::system(path, "write"))?;
        }
        Ok(())
    })
}

pub(super) fn id(row: &Row<'_>, column: usize) -> Result<u64> {
    let text = row.text(column);
    text.parse()
        .map_err(|_| row.error("an id (an integer)", format!("`{text}`")))
}

pub(super) fn pose(row: &Row<'_>, column: usize) -> Result<Pose> {
    let [x, y, z, qx, qy, qz, qw] = row.numbers(column)?;
    Pose::from_parts([x, y, z], [qx, qy, qz, qw]).map_err(|error| row.error("a pose", error))
}

/// The information in the order rotation, translation.
fn information(row: &Row<'_>, column: usize) -> Result<Matrix6<f64>> {
    let values: [f64; 21] = row.numbers(column)?;
    let mut matrix = Matrix6::zeros();
    let mut entries = values.into_iter();
    for r in 0..6 {
        for c in r..6 {
            let place = |k: usize| (k + 3) % 6;
            let value = entries.next().unwrap_or(f64::NAN);
            matrix[(place(r), place(c))] = value;
            matrix[(place(c), place(r))] = value;
        }
    }
    Ok(matrix)
}
