//! The spatial prior: planes in cells of a pyramid, each drawn to the coarser plane around it.
//!
//! zeta = a . b on a plane of the world, with b the pixel's ray: the same three numbers a over the whole
//! image. Moments of information in cells of 4x4 pixels are summed to coarser cells; from the coarsest
//! down, each cell's plane is fitted with that of the coarser cells as prior. No iteration.

mod fit;
mod moments;

use crate::filter::lattice::Lattice;
use crate::filter::state::Node;

use fit::Fit;
use moments::{Moments, basis, cell_moments};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

/// Pixels to a side of the finest cell.
pub(super) const CELL: usize = 4;

/// Levels of cells, each twice as large.
const LEVELS: usize = 5;

#[derive(Clone, Debug)]
struct Level {
    width: usize,
    height: usize,
    moments: Vec<Moments>,
    fits: Vec<Fit>,
}

/// The pyramid, kept from frame to frame.
#[derive(Clone, Debug)]
pub(super) struct Planes {
    levels: Vec<Level>,
    /// Of the finest cells: columns b in the middle, and its slopes by pixel.
    bases: Vec<Matrix3<f64>>,
    wraps: bool,
    roughness: f64,
    /// Least zeta.
    least: f32,
}

impl Planes {
    pub fn new(lattice: &Lattice, roughness: f64, farthest_m: f64) -> Self {
        let (width, height) = (lattice.width.div_ceil(CELL), lattice.height.div_ceil(CELL));
        let mut levels = Vec::new();
        let (mut w, mut h) = (width, height);
        for _ in 0..LEVELS {
            levels.push(Level {
                width: w,
                height: h,
                moments: vec![Moments::NOTHING; w * h],
                fits: vec![Fit::UNKNOWN; w * h],
            });
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
            least: (1.0 / farthest_m) as f32,
        }
    }

    /// Fits all planes to the nodes and moves the nodes' x to them; q follows, so that the mean stays.
    pub fn smooth(&mut self, lattice: &Lattice, nodes: &mut [Node], pixel_noise: f64) {
        self.collect(lattice, nodes);
        for level in 1..self.levels.len() {
            let (fine, coarse) = self.levels.split_at_mut(level);
            coarse[0].sum(&fine[level - 1]);
        }
        for level in (0..self.levels.len()).rev() {
            let (fine, coarse) = self.levels.split_at_mut(level + 1);
            let size = (CELL << level) as f64;
            fine[level].fit(
                coarse.first(),
                self.wraps,
                size,
                self.roughness,
                pixel_noise,
            );
        }
        self.apply(lattice, nodes);
    }

    /// Moments of the finest cells. Sums run over offsets in pixels from the middle, in single
    /// precision relative to one of the cell's values; the ray's base turns them into those of b.
    fn collect(&mut self, lattice: &Lattice, nodes: &[Node]) {
        let finest = &mut self.levels[0];
        let width = finest.width;
        let bases = &self.bases;
        finest
            .moments
            .par_chunks_mut(width)
            .enumerate()
            .for_each(|(row, out)| {
                for (column, out) in out.iter_mut().enumerate() {
                    let base = &bases[row * width + column];
                    *out = cell_moments(lattice, nodes, (column, row), base);
                }
            });
    }

    /// Reads the planes between the cells' middles, and mixes each with what the pixel knows itself.
    fn apply(&self, lattice: &Lattice, nodes: &mut [Node]) {
        let finest = &self.levels[0];
        let rough = (self.roughness * CELL as f64).powi(2) as f32;
        // Planes and variances of the cells in single precision, in rows.
        let cells: Vec<[f32; 5]> = finest
            .fits
            .iter()
            .map(|f| {
                let p = f.plane;
                [
                    p.x as f32,
                    p.y as f32,
                    p.z as f32,
                    f.misfit as f32,
                    f.variance as f32,
                ]
            })
            .collect();
        let width = lattice.width;
        nodes.par_chunks_mut(width).enumerate().for_each_init(
            || vec![[0.0_f32; 5]; finest.width],
            |line, (y, row)| {
                let (top, bottom, t) = between(y, finest.height, false);
                let (top, bottom) = (
                    &cells[top * finest.width..],
                    &cells[bottom * finest.width..],
                );
                for (i, line) in line.iter_mut().enumerate() {
                    *line = std::array::from_fn(|k| top[i][k] + t * (bottom[i][k] - top[i][k]));
                }
                for (x, node) in row.iter_mut().enumerate() {
                    let (left, right, s) = between(x, finest.width, self.wraps);
                    let (left, right) = (&line[left], &line[right]);
                    let cell: [f32; 5] =
                        std::array::from_fn(|k| left[k] + s * (right[k] - left[k]));
                    let b = &lattice.ray[y * width + x];
                    let plane = cell[0] * b.x + cell[1] * b.y + cell[2] * b.z;
                    blend(node, plane, cell[3] + rough, cell[4], self.least);
                }
            },
        );
    }
}

/// The pixel's x: its plane and its own mean, each by its information.
#[inline]
fn blend(node: &mut Node, plane: f32, spread: f32, variance: f32, least: f32) {
    let [x, q, s, _] = *node;
    let seen = plane > least;
    if !seen {
        return;
    }
    let own = s / (s + 1.0 / spread);
    let mean = if s > 0.0 { x + q / s } else { plane };
    let new = plane + own * (mean - plane);
    let possible = new > least;
    if !possible {
        return;
    }
    let rest = 1.0 - own;
    *node = [
        new,
        q + s * (x - new),
        s,
        rest * rest * variance + rest * spread,
    ];
}

/// The two cells between whose middles pixel `i` lies, and the way between them.
#[inline]
fn between(i: usize, cells: usize, wraps: bool) -> (usize, usize, f32) {
    let place = (i as f32 + 0.5) / CELL as f32 - 0.5;
    if place < 0.0 {
        return if wraps {
            (cells - 1, 0, place + 1.0)
        } else {
            (0, 0, 0.0)
        };
    }
    let low = (place as usize).min(cells - 1);
    let high = match () {
        () if low + 1 < cells => low + 1,
        () if wraps => 0,
        () => low,
    };
    (low, high, place - low as f32)
}

impl Level {
    fn sum(&mut self, fine: &Self) {
        self.moments.fill(Moments::NOTHING);
        for (i, moments) in fine.moments.iter().enumerate() {
            let (x, y) = (i % fine.width / 2, i / fine.width / 2);
            self.moments[y * self.width + x].add(moments);
        }
    }

    fn fit(&mut self, coarse: Option<&Self>, wraps: bool, size: f64, roughness: f64, noise: f64) {
        let width = self.width;
        let moments = &self.moments;
        self.fits
            .par_chunks_mut(width)
            .enumerate()
            .for_each(|(y, fits)| {
                for (x, fit) in fits.iter_mut().enumerate() {
                    let own = &moments[y * width + x];
                    let (prior, misfit) = match coarse {
                        Some(coarse) => coarse.read(x, y, wraps),
                        None => (fit.plane, WIDE),
                    };
                    // The coarser cell is twice as large as this one.
                    let spread = misfit + (2.0 * roughness * size).powi(2);
                    let unknown = Self::carried(&prior, spread);
                    *fit = Fit::new(own, &prior, spread, noise).unwrap_or(unknown);
                }
            });
    }

    fn carried(prior: &Vector3<f64>, spread: f64) -> Fit {
        Fit {
            plane: *prior,
            misfit: spread,
            variance: spread,
        }
    }

    /// Plane and misfit between the middles of the four cells around a finer cell's middle.
    fn read(&self, x: usize, y: usize, wraps: bool) -> (Vector3<f64>, f64) {
        let near = |i: usize, size: usize, wraps: bool| {
            let own = (i / 2).min(size - 1);
            let other = match (i % 2, wraps) {
                (0, true) => (own + size - 1) % size,
                (0, false) => own.saturating_sub(1),
                (_, true) => (own + 1) % size,
                (_, false) => (own + 1).min(size - 1),
            };
            (own, other)
        };
        let ((x0, x1), (y0, y1)) = (near(x, self.width, wraps), near(y, self.height, false));
        let mut plane = Vector3::zeros();
        let mut misfit = 0.0;
        for (column, row, share) in [
            (x0, y0, 0.5625),
            (x1, y0, 0.1875),
            (x0, y1, 0.1875),
            (x1, y1, 0.0625),
        ] {
            let fit = &self.fits[row * self.width + column];
            plane += fit.plane * share;
            misfit += fit.misfit * share;
        }
        (plane, misfit)
    }
}

/// Variance of the coarsest planes before anything is seen, 1/m^2.
const WIDE: f64 = 1.0;
