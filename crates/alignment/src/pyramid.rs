//! The averaged images of one frame, from fine to coarse, and the tables that go with them.

use crate::Result;
use crate::binning::{BlockRule, InverseDepth};
use crate::config::Config;
use crate::depth_image::DepthImage;
use crate::pair_input::check_size;
use crate::plane_projection::PlaneProjection;
use crate::sphere_table::SphereTable;
use crate::tiling::Tiling;
use nalgebra::Vector2;
use sphereflow_sphere::Camera;

/// What does not change from frame to frame at one size of blocks.
#[derive(Clone, Debug)]
pub(crate) struct Level {
    pub(crate) camera: Camera,
    pub(crate) plane: Option<PlaneProjection>,
    pub(crate) table: SphereTable,
    pub(crate) tiling: Tiling,
}

/// Inverse depths of one frame, averaged over blocks of pixels on several levels, each with blocks
/// twice as wide as the one before: what [`crate::Aligner`] aligns. Filled by
/// [`crate::Aligner::average`]; the default is empty. Equal settings and cameras make pyramids that
/// may be aligned with each other.
#[derive(Clone, Debug, Default)]
pub struct FramePyramid {
    /// The finest first.
    pub(crate) levels: Vec<InverseDepth>,
    /// Working memory.
    scratch: Vec<f32>,
}

/// The levels of a camera, with the one in reserve.
#[derive(Clone, Debug)]
pub(crate) struct LevelStack {
    size: (usize, usize),
    pub(crate) finest_block: usize,
    rule: BlockRule,
    max_bend: f32,
    /// Depth along the axis over range of each pixel, for cameras without an image plane: towards 90
    /// degrees off the axis inverse depths grow beyond all bounds, inverse ranges do not.
    depth_per_range: Option<Vec<f32>>,
    pub(crate) levels: Vec<Level>,
}

impl FramePyramid {
    /// Without the finest level: a quarter of the memory, and hardly less accurate on real images.
    #[must_use]
    pub fn coarse(&self) -> Self {
        let mut levels = self.levels.clone();
        if levels.len() > 1 {
            levels[0] = InverseDepth::default();
        }
        Self {
            levels,
            scratch: Vec::new(),
        }
    }

    /// Share of the blocks of the finest level known, 0 to 1; 0 without that level.
    pub fn known_share(&self) -> f64 {
        self.levels.first().map_or(0.0, InverseDepth::known_share)
    }

    /// True where both have the same finest level, unknown blocks included: the image repeated.
    pub fn same_as(&self, other: &Self) -> bool {
        match (self.levels.first(), other.levels.first()) {
            (Some(own), Some(other)) => own.same_as(other),
            (own, other) => own.is_none() && other.is_none(),
        }
    }
}

impl LevelStack {
    /// Tables of all levels that [`Config`] asks for and the image has room for, and of one more, in
    /// reserve, where it asks for several.
    pub(crate) fn new(camera: &Camera, config: &Config) -> Result<Self> {
        let finest_block = config.block_for(camera);
        let mut levels = Vec::new();
        let reserve = usize::from(config.levels > 1);
        for level in 0..config.levels + reserve {
            let block = finest_block << level;
            let binned = camera.binned(block);
            // The finest level must exist, coarser ones only where some domains fit in.
            let binned = match binned {
                Ok(binned) if level == 0 || binned.height() >= MIN_COARSE_ROWS => binned,
                Ok(_) => break,
                Err(error) if level == 0 => return Err(error),
                Err(_) => break,
            };
            let wanted = match level {
                0 => config.domains,
                _ => config
                    .domains
                    .min(binned.width() * binned.height() / COARSE_DOMAIN),
            };
            levels.push(Level {
                plane: PlaneProjection::new(&binned),
                table: SphereTable::new(camera, block)?,
                tiling: Tiling::new(binned.width(), binned.height(), wanted.max(1)),
                camera: binned,
            });
        }
        Ok(Self {
            size: (camera.width(), camera.height()),
            finest_block,
            rule: BlockRule {
                block: finest_block,
                known_share: config.block_known_share as f32,
                max_spread: config.max_jump as f32,
            },
            max_bend: config.max_bend as f32,
            depth_per_range: PlaneProjection::new(camera)
                .is_none()
                .then(|| depth_per_range(camera)),
            levels,
        })
    }

    /// Averages an image of the camera's size into all levels.
    pub(crate) fn average(
        &self,
        image: &DepthImage<'_>,
        argument: &str,
        out: &mut FramePyramid,
    ) -> Result<()> {
        check_size(argument, image, self.size)?;
        out.levels.resize_with(self.levels.len(), Default::default);
        out.levels[0].average(image, self.depth_per_range.as_deref(), self.rule);
        self.coarsen(out, 0);
        self.cut_edges(out);
        Ok(())
    }

    /// The finest level of a frame; `None` where it is not of this camera and these settings.
    pub(crate) fn finest_level(&self, frame: &FramePyramid) -> Option<usize> {
        let finest = frame.levels.iter().position(|l| !l.values.is_empty())?;
        let blocks = |level: &Level| level.table.width * level.table.height;
        let sizes = frame.levels.iter().zip(&self.levels).skip(finest);
        let fits = frame.levels.len() == self.levels.len()
            && sizes
                .into_iter()
                .all(|(level, tables)| level.values.len() == blocks(tables));
        fits.then_some(finest)
    }

    /// On the finest of several levels, where the images are warped by a good estimate, domains do
    /// without the blocks on edges between surfaces: what one image hides there is a bias. Where
    /// noise hides the edges themselves nothing is cut, as that would cut the noise.
    fn cut_edges(&self, out: &mut FramePyramid) {
        let FramePyramid { levels, scratch } = out;
        if levels.len() < 2 {
            return;
        }
        let width = self.levels[0].table.width;
        if EDGE_CONTRAST * levels[0].bend_noise(width, scratch) < self.max_bend {
            levels[0].cut_edges(width, self.max_bend, scratch);
        }
    }

    /// The levels coarser than `finest` anew from it.
    pub(crate) fn coarsen(&self, out: &mut FramePyramid, finest: usize) {
        let (finer, coarser) = out.levels.split_at_mut(finest + 1);
        for (k, level) in coarser.iter_mut().enumerate() {
            let rule = BlockRule {
                block: 2 << k,
                ..self.rule
            };
            level.average_of(&finer[finest], self.levels[finest].table.width, rule);
        }
    }
}

/// Cosine of the angle off the axis, pixel by pixel; NaN where the camera sees nothing.
fn depth_per_range(camera: &Camera) -> Vec<f32> {
    let (width, height) = (camera.width(), camera.height());
    let pixels = (0..width * height).map(|i| Vector2::new((i % width) as f64, (i / width) as f64));
    pixels
        .map(|pixel| {
            camera
                .unproject(&pixel)
                .map_or(f32::NAN, |ray| ray.normalize().z as f32)
        })
        .collect()
}

/// An edge must stand out of the noise by this factor to be seen.
const EDGE_CONTRAST: f32 = 6.0;
/// Rows of blocks that the coarsest level needs: fewer make no domains.
const MIN_COARSE_ROWS: usize = 24;
/// Blocks in a domain of the coarser levels.
const COARSE_DOMAIN: usize = 25;
