//! Pixels drawn to the planes of the surface that they are on.

use super::level::Level;
use super::{CELL, knows};
use crate::filter::lattice::Lattice;
use crate::filter::state::Node;
use crate::filter::surfaces::ONE_SURFACE;
use nalgebra::Vector3;
use rayon::prelude::*;

/// Reads the planes between the cells' middles, and mixes each with what the pixel knows itself.
pub(super) struct Apply<'a> {
    pub lattice: &'a Lattice,
    pub cells: &'a Level,
    pub wraps: bool,
    /// Variance by which a pixel departs from its cell's plane, 1/m^2.
    pub rough: f32,
    /// Least zeta.
    pub least: f32,
}

/// Plane (three numbers), misfit and variance of a surface, in single precision.
type Plane = [f32; 5];

impl Apply<'_> {
    pub fn to(&self, nodes: &mut [Node]) {
        let planes: Vec<Plane> = self
            .cells
            .surfaces
            .iter()
            .map(|surface| {
                let (p, fit) = (surface.fit.plane, &surface.fit);
                [p.x, p.y, p.z, fit.misfit, fit.variance].map(|v| v as f32)
            })
            .collect();
        let (width, columns) = (self.lattice.width, self.cells.width);
        nodes.par_chunks_mut(width).enumerate().for_each_init(
            || (vec![[0.0_f32; 5]; columns], vec![true; columns]),
            |(line, even), (y, row)| {
                let (top, bottom, t) = between(y, self.cells.height, false);
                let (upper, lower) = (&planes[top * columns..], &planes[bottom * columns..]);
                for (i, line) in line.iter_mut().enumerate() {
                    *line = std::array::from_fn(|k| upper[i][k] + t * (lower[i][k] - upper[i][k]));
                }
                for (column, even) in even.iter_mut().enumerate() {
                    *even = self.is_even(&planes, column, (top, bottom), y);
                }
                for (x, node) in row.iter_mut().enumerate() {
                    let (left, right, s) = between(x, columns, self.wraps);
                    let b = &self.lattice.ray[y * width + x];
                    let cell = if even[left] {
                        let (left, right) = (&line[left], &line[right]);
                        std::array::from_fn(|k| left[k] + s * (right[k] - left[k]))
                    } else {
                        self.same_surface(&planes, node, b, ([left, right], s), ([top, bottom], t))
                    };
                    let plane = dot(&cell, b);
                    let variance = cell[4] + unseen(node, plane);
                    blend(node, plane, cell[3] + self.rough, variance, self.least);
                }
            },
        );
    }

    /// Whether the four cells from `column` on have one surface.
    fn is_even(&self, planes: &[Plane], column: usize, rows: (usize, usize), y: usize) -> bool {
        let (columns, width) = (self.cells.width, self.lattice.width);
        let right = match column + 1 < columns {
            true => column + 1,
            false if self.wraps => 0,
            false => column,
        };
        let four = [rows.0, rows.1].map(|row| [row * columns + column, row * columns + right]);
        if four
            .iter()
            .flatten()
            .any(|cell| self.cells.second[*cell] > 0)
        {
            return false;
        }
        let x = (column * CELL + CELL - 1).min(width - 1);
        let b = &self.lattice.ray[y * width + x];
        let zetas = four.map(|row| row.map(|cell| dot(&planes[cell], b)));
        let (least, most) = zetas
            .iter()
            .flatten()
            .fold((f32::INFINITY, 0.0_f32), |(a, b), z| (a.min(*z), b.max(*z)));
        // Also true for NaN.
        let two = most - least > ONE_SURFACE as f32 * most;
        !two
    }

    /// The mix of the planes around a pixel that are of the surface whose plane comes closest to its zeta; or, where
    /// it knows nothing, of the first surface of its cell.
    #[inline(never)]
    fn same_surface(
        &self,
        planes: &[Plane],
        node: &Node,
        b: &Vector3<f32>,
        (columns, s): ([usize; 2], f32),
        (rows, t): ([usize; 2], f32),
    ) -> Plane {
        let (zeta, knows) = (node[0], knows(node));
        let mut found = [(0.0_f32, 0.0_f32, &planes[0]); 4];
        let mut closest = 0;
        for (i, found) in found.iter_mut().enumerate() {
            let cell = rows[i / 2] * self.cells.width + columns[i % 2];
            let share = [1.0 - s, s][i % 2] * [1.0 - t, t][i / 2];
            let mut plane = &planes[cell];
            if knows && self.cells.second[cell] > 0 {
                let second = &planes[self.cells.second[cell]];
                let off = |plane: &Plane| (dot(plane, b) - zeta).abs();
                plane = if off(second) < off(plane) {
                    second
                } else {
                    plane
                };
            }
            *found = (dot(plane, b), share, plane);
        }
        for (i, (there, share, _)) in found.iter().enumerate() {
            let closer = match knows {
                true => (there - zeta).abs() < (found[closest].0 - zeta).abs(),
                false => *share > found[closest].1,
            };
            closest = if closer { i } else { closest };
        }
        let (here, _, own) = found[closest];
        let (mut mix, mut total) = ([0.0_f32; 5], 0.0_f32);
        for (there, share, plane) in found {
            let doubt = 2.0 * (own[4] + plane[4]).sqrt();
            if (there - here).abs() <= doubt.max(ONE_SURFACE as f32 * here) {
                mix = std::array::from_fn(|k| mix[k] + share * plane[k]);
                total += share;
            }
        }
        match total > 1e-3 {
            true => mix.map(|v| v / total),
            false => *own,
        }
    }
}

#[inline(always)]
fn dot(plane: &Plane, b: &Vector3<f32>) -> f32 {
    plane[0] * b.x + plane[1] * b.y + plane[2] * b.z
}

/// Variance of a pixel that knows nothing itself, which may be on another surface than its cell.
#[inline]
fn unseen(node: &Node, zeta: f32) -> f32 {
    match knows(node) {
        true => 0.0,
        false => (super::fit::OTHER as f32 * zeta).powi(2),
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
