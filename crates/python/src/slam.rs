//! `VoxelCloud`: the map.

use crate::arrays::{colour as colour_image, metres};
use crate::camera::PyCamera;
use crate::errors::{IntoPython, Kind, exception};
use crate::trajectory::pose_from;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use sphereflow_core::{DepthMap, RangeMap};
use sphereflow_io::ply::{ColouredPoint, write_ply};
use sphereflow_slam::VoxelCloud;
use std::path::PathBuf;

/// What a point is drawn in that was never seen with colour.
const COLOURLESS: [u8; 3] = [128; 3];

/// Positions and colours of a cloud.
type Arrays<'py> = (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray2<u8>>);

/// A coloured point cloud, one mean point a voxel, in order of first sight.
#[pyclass(name = "VoxelCloud", module = "sphereflow.slam")]
pub struct PyVoxelCloud(pub VoxelCloud);

#[pymethods]
impl PyVoxelCloud {
    #[new]
    #[pyo3(signature = (voxel_m = 0.02, *, max_points = 20_000_000))]
    fn new(voxel_m: f64, max_points: usize) -> PyResult<Self> {
        VoxelCloud::new(voxel_m, max_points).into_python().map(Self)
    }

    /// Add a depth image.
    ///
    /// Parameters
    /// ----------
    /// depth_m : array_like of float, (H, W)
    ///     Metres, NaN unknown.
    /// colour : array_like of uint8, (H, W, 3), or None
    ///     RGB of the same pixels.
    /// camera : Camera
    ///     The camera of the image.
    /// world_from_camera : array_like, (4, 4)
    ///     Its pose.
    /// stride : int
    ///     Take every `stride`-th pixel of every `stride`-th row.
    /// max_range_m : float
    ///     Leave out points further than this along the ray.
    /// along : {'axis', 'ray'}
    ///     What `depth_m` holds.
    ///
    /// Returns
    /// -------
    /// int
    ///     Number of points added.
    #[pyo3(signature = (depth_m, colour, camera, world_from_camera, *, stride = 4,
        max_range_m = 5.0, along = "axis"))]
    #[allow(clippy::too_many_arguments)]
    fn add(
        &mut self,
        py: Python<'_>,
        depth_m: &Bound<'_, PyAny>,
        colour: Option<&Bound<'_, PyAny>>,
        camera: &PyCamera,
        world_from_camera: &Bound<'_, PyAny>,
        stride: usize,
        max_range_m: f64,
        along: &str,
    ) -> PyResult<usize> {
        let size = Some((camera.0.width(), camera.0.height()));
        let plane = metres(depth_m, "depth_m", size)?;
        let colour = colour
            .map(|image| colour_image(image, "colour", size))
            .transpose()?;
        let pose = pose_from(world_from_camera, "world_from_camera")?;
        let (cloud, camera, colour) = (&mut self.0, &camera.0, colour.as_ref());
        match along {
            "axis" => py.detach(|| {
                cloud.add(
                    &DepthMap::new(plane),
                    colour,
                    camera,
                    &pose,
                    stride,
                    max_range_m,
                )
            }),
            "ray" => py.detach(|| {
                cloud.add_ranges(
                    &RangeMap::new(plane),
                    colour,
                    camera,
                    &pose,
                    stride,
                    max_range_m,
                )
            }),
            other => {
                let text =
                    format!("along: expected 'axis' (depth) or 'ray' (range), found '{other}'");
                return Err(exception(Kind::Value, text));
            }
        }
        .into_python()
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }

    /// Observations left out because the cloud was full or they lay beyond its bounds.
    #[getter]
    fn dropped(&self) -> u64 {
        self.0.dropped()
    }

    /// Points in the world, metres, float32 (N, 3), and their colours, uint8 (N, 3); middle grey
    /// where a point was never seen with colour.
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Arrays<'py>> {
        let cloud = self.0.points();
        let count = cloud.positions.len();
        let colours: Vec<u8> = cloud
            .colours
            .iter()
            .flat_map(|c| c.unwrap_or(COLOURLESS))
            .collect();
        Ok((
            PyArray1::from_vec(py, cloud.positions.into_flattened()).reshape([count, 3])?,
            PyArray1::from_vec(py, colours).reshape([count, 3])?,
        ))
    }

    /// Write the cloud as binary PLY, beside and then renamed.
    fn write_ply(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| {
            let cloud = self.0.points();
            let points: Vec<ColouredPoint> = cloud
                .positions
                .into_iter()
                .zip(cloud.colours)
                .map(|(position_m, colour)| {
                    let colour = colour.unwrap_or(COLOURLESS);
                    ColouredPoint { position_m, colour }
                })
                .collect();
            write_ply(&path, "sphereflow map, world frame, metres", points)
        })
        .into_python()
    }

    fn __repr__(&self) -> String {
        format!("VoxelCloud({} points)", self.0.len())
    }
}
