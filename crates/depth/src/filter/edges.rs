//! Beside a depth edge a pixel may belong to the other surface: what that adds to its variance.

use super::lattice::Lattice;
use super::planes::CELL;
use super::state::Node;
use super::surfaces::SLOPE_PER_RAD;

/// Cells to each side in which another surface is looked for: as far as planes reach across an edge.
const REACH: usize = 2;

/// Share of the pixels beside an edge that are on its wrong side, as seen on simulated rooms
/// (`depth_accuracy`).
const WRONG: f32 = 0.7;

/// Share of the bend of zeta over a cell by which planes cut it short, as seen on simulated rooms.
const CUT: f32 = 0.3;

/// Bend, as a share of zeta, that smooth surfaces and what noise leaves have as well.
const SMOOTH: f32 = 0.002;

/// Least and largest zeta around every cell.
pub(super) struct Edges {
    width: usize,
    around: Vec<[f32; 2]>,
    /// Variance by the bend of zeta, 1/m^2, of every cell.
    bent: Vec<f32>,
    /// Share by which zeta changes on slopes, over the reach.
    slope: f32,
}

impl Edges {
    pub fn new(lattice: &Lattice, nodes: &[Node]) -> Self {
        let (width, height) = (lattice.width.div_ceil(CELL), lattice.height.div_ceil(CELL));
        let nothing = [f32::INFINITY, 0.0_f32];
        let mut cells = vec![nothing; width * height];
        for (y, row) in nodes.chunks_exact(lattice.width).enumerate() {
            let cells = &mut cells[y / CELL * width..][..width];
            for (cell, nodes) in cells.iter_mut().zip(row.chunks(CELL)) {
                for node in nodes {
                    // Also false for NaN.
                    if node[0] > 0.0 {
                        *cell = [cell[0].min(node[0]), cell[1].max(node[0])];
                    }
                }
            }
        }
        let join = |a: [f32; 2], b: &[f32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        let reach = |i: usize, size: usize| i.saturating_sub(REACH)..(i + REACH + 1).min(size);
        let across: Vec<[f32; 2]> = (0..width * height)
            .map(|i| {
                let row = &cells[i / width * width..][..width];
                row[reach(i % width, width)].iter().fold(nothing, join)
            })
            .collect();
        let around = (0..width * height)
            .map(|i| {
                let rows = reach(i / width, height);
                rows.fold(nothing, |a, y| join(a, &across[y * width + i % width]))
            })
            .collect();
        let bent = bends(lattice, nodes, (width, height));
        let slope = SLOPE_PER_RAD * (REACH * CELL + CELL / 2) as f32 / lattice.focal_px;
        Self {
            width,
            around,
            bent,
            slope,
        }
    }

    /// The cells of row `y` of the lattice.
    pub fn row(&self, y: usize) -> EdgeRow<'_> {
        let start = y / CELL * self.width;
        EdgeRow {
            around: &self.around[start..][..self.width],
            bent: &self.bent[start..][..self.width],
            slope: self.slope,
        }
    }
}

/// [`Edges`] of a row of the lattice.
#[derive(Clone, Copy)]
pub(super) struct EdgeRow<'a> {
    around: &'a [[f32; 2]],
    bent: &'a [f32],
    slope: f32,
}

impl EdgeRow<'_> {
    /// What [`EdgeRow::variance`] asks for at column `x` of the lattice.
    #[inline(always)]
    pub fn at(&self, x: usize) -> [f32; 3] {
        let [least, most] = self.around[x / CELL];
        [least, most, self.bent[x / CELL]]
    }

    /// Variance of zeta, 1/m^2.
    #[inline(always)]
    pub fn variance(&self, zeta: f32, [least, most, bent]: [f32; 3]) -> f32 {
        let (nearer, farther) = (most - zeta, zeta - least);
        let off = if nearer > farther { nearer } else { farther };
        let off = off - self.slope * zeta;
        let edge = if off > 0.0 { WRONG * off * off } else { 0.0 };
        if edge > bent { edge } else { bent }
    }
}

/// Variance by the bend of zeta over every cell: where walls meet, planes round the corner off.
fn bends(lattice: &Lattice, nodes: &[Node], (width, height): (usize, usize)) -> Vec<f32> {
    let mut sums = vec![[0.0_f32; 2]; width * height];
    for (y, row) in nodes.chunks_exact(lattice.width).enumerate() {
        let sums = &mut sums[y / CELL * width..][..width];
        for (sum, nodes) in sums.iter_mut().zip(row.chunks(CELL)) {
            nodes.iter().for_each(|node| sum[0] += node[0]);
            sum[1] += nodes.len() as f32;
        }
    }
    let zeta: Vec<f32> = sums.iter().map(|[sum, count]| sum / count).collect();
    // Cells that are cut off have their middle elsewhere.
    let whole = (lattice.width / CELL, lattice.height / CELL);
    let bend = |i: usize| {
        let (x, y) = (i % width, i / width);
        let beside = |inner: bool, step: usize| match inner {
            true => (zeta[i - step] + zeta[i + step] - 2.0 * zeta[i]).abs(),
            false => 0.0,
        };
        let across = beside(x > 0 && x + 1 < whole.0, 1);
        let down = beside(y > 0 && y + 1 < whole.1, width);
        let over = across.max(down) - SMOOTH * zeta[i];
        // Also false for NaN: a pixel without a ray has no zeta.
        if over > 0.0 {
            CUT * CUT * over * over
        } else {
            0.0
        }
    };
    (0..width * height).map(bend).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to
mod tests {
    use super::*;
    use sphereflow_sphere::Camera;

    /// Not a multiple of a cell.
    const WIDTH: usize = 97;
    const HEIGHT: usize = 66;
    /// Slope of zeta on both walls, 1/m per pixel: so small that it is no edge.
    const SLOPE: f32 = 0.002;
    /// Single precision of a variance by differences of means.
    const ROUNDING: f32 = 1e-3;

    fn edges(zeta: impl Fn(usize) -> f32) -> Edges {
        let camera = Camera::pinhole(100.0, 100.0, 48.0, 32.5, WIDTH, HEIGHT).unwrap();
        let lattice = Lattice::new(&camera).unwrap();
        let node = |i: usize| [zeta(i % WIDTH), 0.0, 1.0, 1.0];
        let nodes: Vec<Node> = (0..WIDTH * HEIGHT).map(node).collect();
        Edges::new(&lattice, &nodes)
    }

    fn variance(edges: &Edges, zeta: f32, x: usize, y: usize) -> f32 {
        let row = edges.row(y);
        row.variance(zeta, row.at(x))
    }

    #[test]
    fn a_corner_of_two_walls_is_uncertain_by_its_bend_and_the_walls_are_not() {
        let middle = (12 * CELL) as f32 + 0.5 * (CELL - 1) as f32;
        let zeta = |x: usize| 0.5 + SLOPE * (x as f32 - middle).abs();
        let edges = edges(zeta);
        for (x, y) in [(12 * CELL, 0), (12 * CELL + 1, 33), (13 * CELL - 1, 65)] {
            let mean = 0.5 + SLOPE;
            let bend = 2.0 * (SLOPE * CELL as f32 - SLOPE) - SMOOTH * mean;
            let expected = (CUT * bend).powi(2);
            let found = variance(&edges, zeta(x), x, y);
            assert!(
                (found / expected - 1.0).abs() < ROUNDING,
                "{found}, {expected}"
            );
        }
        for x in (0..11 * CELL).chain(14 * CELL..WIDTH) {
            assert_eq!(variance(&edges, zeta(x), x, 33), 0.0, "column {x}");
        }
    }

    #[test]
    fn a_bend_as_of_smooth_surfaces_adds_nothing() {
        // A parabola whose second difference over a cell is half of what is let pass.
        let curved = 0.25 * SMOOTH / (CELL * CELL) as f32;
        let zeta = |x: usize| 0.5 + 0.5 * curved * (x as f32 - 48.0).powi(2);
        let edges = edges(zeta);
        for x in 0..WIDTH {
            assert_eq!(variance(&edges, zeta(x), x, 20), 0.0, "column {x}");
        }
    }
}
