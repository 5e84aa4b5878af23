//! The spatial prior: planes in cells of a pyramid, each drawn to the coarser plane around it.
//!
//! zeta = a . b on a plane of the world, with b the pixel's ray: the same three numbers a over the whole
//! image. Moments of information in cells of 4x4 pixels are summed to coarser cells; from the coarsest
//! down, each cell's plane is fitted with that of the coarser cells as prior, or with that of a
//! neighbour which explains its
//! pixels better; on coarse levels planes so go on by a few cells. A cell may hold two surfaces, one before the other:
//! neither draws the other one's planes.

mod apply;
mod fit;
mod level;
mod moments;
mod rivals;

use crate::filter::lattice::Lattice;
use crate::filter::state::Node;
use crate::filter::surfaces::SLOPE_PER_RAD;

use apply::Apply;
use level::Level;
use moments::{Cell, basis};
use nalgebra::Matrix3;

/// Pixels to a side of the finest cell.
pub(super) const CELL: usize = 4;

/// Levels of cells, each twice as large.
const LEVELS: usize = 5;

/// The finest level on which planes go from cell to cell; finer cells see too few pixels to choose by.
const PROPAGATED: usize = 2;

/// What planes of a level differ by from those of the coarser one, over the roughness of their own cells: between that
/// of a cell (1) and that of one twice as large.
const COARSER: f64 = 1.6;

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
            let rough = (COARSER * self.roughness * size).powi(2);
            fine[level].fit(coarse.first(), self.wraps, rough, pixel_noise);
            if level >= PROPAGATED {
                fine[level].propagate(self.wraps, rough, pixel_noise);
            }
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

#[cfg(test)]
#[allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};
    use sphereflow_sphere::Camera;

    const WIDTH: usize = 96;
    const HEIGHT: usize = 64;
    const ROUGHNESS: f64 = 0.034 / 100.0;
    /// Share of a pixel's nominal variance that is noise: any.
    const NOISE: f64 = 0.2;
    /// What smoothing may move a pixel by that lies on a plane with its neighbours, as a share of its zeta: no more
    /// than one and a half of its deviations. The other surface is 60 % off.
    const STAYS: f32 = 0.015;

    fn lattice() -> Lattice {
        let (cx, cy) = (0.5 * (WIDTH - 1) as f64, 0.5 * (HEIGHT - 1) as f64);
        Lattice::new(&Camera::pinhole(100.0, 100.0, cx, cy, WIDTH, HEIGHT).unwrap()).unwrap()
    }

    /// Nodes that are known to a hundredth, of a zeta by place.
    fn nodes(zeta: impl Fn(usize, usize) -> f32) -> Vec<Node> {
        let node = |i: usize| {
            let zeta = zeta(i % WIDTH, i / WIDTH);
            let variance = (0.01 * zeta).powi(2);
            [zeta, 0.0, 1.0 / variance, variance]
        };
        (0..WIDTH * HEIGHT).map(node).collect()
    }

    #[test]
    fn surfaces_before_one_another_do_not_draw_each_other_wherever_the_edge_is() {
        let lattice = lattice();
        for edge in 46..50 {
            let zeta = |x: usize, y: usize| match x < edge {
                true => 0.8,
                // A slanted wall behind.
                false => 0.5 + 0.001 * (x as f32 - 48.0) - 0.0005 * (y as f32 - 32.0),
            };
            let mut state = nodes(zeta);
            let mut planes = Planes::new(&lattice, ROUGHNESS, 20.0);
            planes.smooth(&lattice, &mut state, NOISE);
            for (i, node) in state.iter().enumerate() {
                let expected = zeta(i % WIDTH, i / WIDTH);
                assert!(
                    (node[0] - expected).abs() < STAYS * expected,
                    "column {} of an edge at {edge}: {} for {expected}",
                    i % WIDTH,
                    node[0]
                );
            }
        }
    }

    #[test]
    fn a_pixel_that_knows_nothing_takes_the_plane_of_its_cell() {
        let lattice = lattice();
        let wall = |x: usize, _: usize| 0.5 + 0.001 * x as f32;
        let mut state = nodes(wall);
        let lost = 30 * WIDTH + 41;
        state[lost] = [0.2, 0.0, 1e-3, 1.0];
        Planes::new(&lattice, ROUGHNESS, 20.0).smooth(&lattice, &mut state, NOISE);
        assert!((state[lost][0] - wall(41, 30)).abs() < STAYS);
    }

    /// A wall up to column 72 that is known to a thousandth, and another beyond, turned towards
    /// the camera, of which each
    /// pixel measures zeta only to the share `beyond`, by row: the state has it as the first
    /// one's continuation. Returns
    /// nodes and true zeta.
    fn corner(rng: &mut ChaCha8Rng, beyond: impl Fn(usize) -> f32) -> (Vec<Node>, Vec<f32>) {
        let mut truth = Vec::new();
        let node = |i: usize| {
            let (x, y) = (i % WIDTH, i / WIDTH);
            let continued = 0.5 - 0.001 * x as f32 + 0.0002 * y as f32;
            let (zeta, share) = match x > 72 {
                true => (continued + 0.006 * (x - 72) as f32, beyond(y)),
                false => (continued, 0.001),
            };
            truth.push(zeta);
            let deviation = share * zeta;
            let information = 1.0 / (deviation * deviation);
            let noise: f32 = StandardNormal.sample(rng);
            let mean = zeta + (NOISE as f32).sqrt() * deviation * noise;
            let variance = (0.01 * zeta).powi(2);
            [
                continued,
                information * (mean - continued),
                information,
                variance,
            ]
        };
        let nodes = (0..WIDTH * HEIGHT).map(node).collect();
        (nodes, truth)
    }

    /// What the second wall is off by in the mean, as a share, in rows.
    fn off_beyond(rows: std::ops::Range<usize>, nodes: &[Node], truth: &[f32]) -> f32 {
        let pixels = rows.flat_map(|y| (77..WIDTH).map(move |x| y * WIDTH + x));
        let off: Vec<f32> = pixels
            .map(|i| (nodes[i][0] - truth[i]).abs() / truth[i])
            .collect();
        off.iter().sum::<f32>() / off.len() as f32
    }

    /// Before and after smoothing, in the mean of some draws.
    fn smoothed(seed: u64, rows: std::ops::Range<usize>, beyond: fn(usize) -> f32) -> [f32; 2] {
        const DRAWS: usize = 8;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let lattice = lattice();
        let mut sums = [0.0; 2];
        for _ in 0..DRAWS {
            let (mut nodes, truth) = corner(&mut rng, beyond);
            sums[0] += off_beyond(rows.clone(), &nodes, &truth) / DRAWS as f32;
            Planes::new(&lattice, ROUGHNESS, 20.0).smooth(&lattice, &mut nodes, NOISE);
            sums[1] += off_beyond(rows.clone(), &nodes, &truth) / DRAWS as f32;
        }
        sums
    }

    #[test]
    fn a_wall_beyond_a_corner_is_not_drawn_to_the_continued_one_by_what_is_known_of_that() {
        let [before, after] = smoothed(1, 0..HEIGHT, |_| 1.0);
        assert!(before > 0.15 && after < 0.05, "{before}, then {after}");
    }

    #[test]
    fn a_wall_beyond_a_corner_goes_on_where_its_own_pixels_say_little() {
        let beyond = |y| if y < 32 { 0.2 } else { 1.6 };
        let [before, after] = smoothed(2, 36..HEIGHT, beyond);
        assert!(before > 0.15 && after < 0.06, "{before}, then {after}");
    }
}
