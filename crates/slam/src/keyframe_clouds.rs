//! The cloud in pieces: what each keyframe's frames saw, in the keyframe's own frame, so that the
//! surface moves with the graph and no frame is read twice.

use crate::{Result, VoxelCloud};
use sphereflow_core::{DepthMap, Plane, Pose, RangeMap, checks};
use sphereflow_sphere::Camera;

/// One frame's distances: along the optical axis, or along the ray.
#[derive(Clone, Copy, Debug)]
pub enum Distances<'a> {
    /// Depth.
    Depth(&'a DepthMap),
    /// Range.
    Range(&'a RangeMap),
}

/// How images are added.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudConfig {
    /// Edge of a voxel, metres.
    pub voxel_m: f64,
    /// Every so many-th pixel of every so many-th row is taken.
    pub stride: usize,
    /// Points further along the ray are left out, metres.
    pub max_range_m: f64,
    /// Points that a cloud has at most.
    pub max_points: usize,
}

impl Default for CloudConfig {
    fn default() -> Self {
        Self {
            voxel_m: 0.02,
            stride: 4,
            max_range_m: 5.0,
            max_points: 20_000_000,
        }
    }
}

impl CloudConfig {
    /// Checks every setting.
    ///
    /// # Errors
    /// A core value error naming the first setting out of its range.
    pub fn validate(&self) -> Result<()> {
        checks::positive("voxel_m", self.voxel_m)?;
        checks::within("stride", self.stride, 1..=1000)?;
        checks::positive("max_range_m", self.max_range_m)?;
        checks::within("max_points", self.max_points, 1..=1 << 31)
    }
}

/// A cloud for each keyframe, and their union at the poses that were last asked for.
#[derive(Clone, Debug)]
pub struct KeyframeClouds {
    config: CloudConfig,
    pieces: Vec<VoxelCloud>,
    whole: VoxelCloud,
    /// Pieces that are in `whole`, which no frame is added to any more.
    merged: usize,
}

impl KeyframeClouds {
    /// Without anything in it.
    ///
    /// # Errors
    /// As [`VoxelCloud::new`].
    pub fn new(config: CloudConfig) -> Result<Self> {
        Ok(Self {
            config,
            pieces: Vec::new(),
            whole: VoxelCloud::new(config.voxel_m, config.max_points)?,
            merged: 0,
        })
    }

    /// Adds a frame that hangs on keyframe `keyframe`; its number of points.
    ///
    /// # Errors
    /// As [`VoxelCloud::add`].
    pub fn add(
        &mut self,
        keyframe: usize,
        keyframe_from_camera: &Pose,
        camera: &Camera,
        distances: Distances<'_>,
        colour: Option<&Plane<[u8; 3]>>,
    ) -> Result<usize> {
        let config = self.config;
        while self.pieces.len() <= keyframe {
            self.pieces
                .push(VoxelCloud::new(config.voxel_m, config.max_points)?);
        }
        let (piece, pose) = (&mut self.pieces[keyframe], keyframe_from_camera);
        let (stride, limit_m) = (config.stride, config.max_range_m);
        match distances {
            Distances::Depth(depth) => piece.add(depth, colour, camera, pose, stride, limit_m),
            Distances::Range(range) => {
                piece.add_ranges(range, colour, camera, pose, stride, limit_m)
            }
        }
    }

    /// The pieces whose keyframe is followed by another, at their poses: what was merged before
    /// stays where it was. For looking on while the map grows.
    pub fn grown(&mut self, poses: &[Pose]) -> &VoxelCloud {
        let done = self.pieces.len().saturating_sub(1).min(poses.len());
        let pieces = self.pieces.iter().zip(poses).take(done);
        for (piece, pose) in pieces.skip(self.merged) {
            self.whole.merge(piece, pose);
        }
        self.merged = self.merged.max(done);
        &self.whole
    }

    /// All pieces anew, at the poses of their keyframes.
    ///
    /// # Errors
    /// As [`VoxelCloud::new`].
    pub fn united(&mut self, poses: &[Pose]) -> Result<&VoxelCloud> {
        self.whole = VoxelCloud::new(self.config.voxel_m, self.config.max_points)?;
        for (piece, pose) in self.pieces.iter().zip(poses) {
            self.whole.merge(piece, pose);
        }
        self.merged = self.pieces.len();
        Ok(&self.whole)
    }

    /// The union as it was last made.
    pub fn whole(&self) -> &VoxelCloud {
        &self.whole
    }
}
