//! The spatial prior: planes in cells of a pyramid, each drawn to the coarser plane around it.
//!
//! zeta = a . b on a plane of the world, with b the pixel's ray: the same three numbers a over the whole
//! image. Moments of information in cells of 4x4 pixels are summed to coarser cells; from the coarsest
//! down, each cell's plane is fitted with that of the coarser cells as prior. No iteration. A cell may hold two
//! surfaces, one before the other: neither draws the other one's planes.

mod apply;
mod fit;
mod level;
mod moments;

use crate::filter::lattice::Lattice;
use crate::filter::state::Node;

use apply::Apply;
use level::Level;
use moments::{Cell, basis};
use nalgebra::Matrix3;

/// Pixels to a side of the finest cell.
pub(super) const CELL: usize = 4;

/// Levels of cells, each twice as large.
const LEVELS: usize = 5;

/// Surfaces whose zeta differs by less than this share are one.
const ONE_SURFACE: f64 = 0.05;

/// A surface whose zeta changes by less than this share per radian is a slope, and not two surfaces.
const SLOPE_PER_RAD: f32 = 2.75;

/// Whether a pixel's own information says anything of the surface it is on.
#[inline(always)]
fn knows(node: &Node) -> bool {
    /// Information, as 1 over the relative variance.
    const LEAST: f32 = 2.0;
    node[2] * node[0] * node[0] > LEAST
}

/// The pyramid, kept from frame to frame.
#[derive(Clone, Debug)]
pub(super) struct Planes {
    levels: Vec<Level>,
    /// Of the finest cells: columns b in the middle, and its slopes by pixel.
    bases: Vec<Matrix3<f64>>,
    wraps: bool,
    roughness: f64,
    /// Share by which zeta changes on slopes, over a cell.
    slope: f32,
    /// Least zeta.
    least: f32,
}

impl Planes {
    pub fn new(lattice: &Lattice, roughness: f64, farthest_m: f64) -> Self {
        let (width, height) = (lattice.width.div_ceil(CELL), lattice.height.div_ceil(CELL));
        let mut levels = Vec::new();
        let (mut w, mut h) = (width, height);
        for _ in 0..LEVELS {
            levels.push(Level::new(w, h));
            if w.min(h) <= 2 {
                break;
            }
            (w, h) = (w.div_ceil(2), h.div_ceil(2));
        }
        let bases = (0..width * height)
            .map(|i| basis(lattice, i % width, i / width))
            .collect();
        Self {
            levels,
            bases,
            wraps: lattice.wraps,
            roughness,
            slope: SLOPE_PER_RAD * (CELL - 1) as f32 / lattice.focal_px,
            least: (1.0 / farthest_m) as f32,
        }
    }

    /// Fits all planes to the nodes and moves the nodes' x to them; q follows, so that the mean stays.
    pub fn smooth(&mut self, lattice: &Lattice, nodes: &mut [Node], pixel_noise: f64) {
        self.collect(lattice, nodes);
        for level in 1..self.levels.len() {
            let (fine, coarse) = self.levels.split_at_mut(level);
            coarse[0].sum(&mut fine[level - 1]);
        }
        for level in (0..self.levels.len()).rev() {
            let (fine, coarse) = self.levels.split_at_mut(level + 1);
            let size = (CELL << level) as f64;
            // The coarser cell is twice as large as this one.
            let rough = (2.0 * self.roughness * size).powi(2);
            fine[level].fit(coarse.first(), self.wraps, rough, pixel_noise);
        }
        Apply {
            lattice,
            cells: &self.levels[0],
            wraps: self.wraps,
            rough: (self.roughness * CELL as f64).powi(2) as f32,
            least: self.least,
        }
        .to(nodes);
    }

    /// Moments of the finest cells. Sums run over offsets in pixels from the middle, in single
    /// precision relative to one of the cell's values; the ray's base turns them into those of b.
    fn collect(&mut self, lattice: &Lattice, nodes: &[Node]) {
        let (bases, slope) = (&self.bases, self.slope);
        let width = self.levels[0].width;
        self.levels[0].collect(|i| {
            let cell = Cell {
                lattice,
                nodes,
                column: i % width,
                row: i / width,
                base: &bases[i],
            };
            let [least, most] = cell.extremes();
            // Also false for NaN.
            if most - least > slope * (most + least) {
                let [near, far] = cell.divided(0.5 * (most + least));
                return (near, Some(far));
            }
            (cell.moments(), None)
        });
    }
}
