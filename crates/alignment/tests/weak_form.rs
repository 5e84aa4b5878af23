//! The weak form written slowly: every domain goes around each of its blocks, in double precision.

#![allow(clippy::unwrap_used)] // a test may

use nalgebra::Vector3;
use sphereflow_alignment::Pair;
use sphereflow_alignment::area_integrals::AreaIntegrals;
use sphereflow_alignment::sphere_table::SphereTable;
use sphereflow_alignment::tiling::Tiling;
use sphereflow_alignment::weak_form::WeakForm;
use sphereflow_sphere::{Camera, SphereGrid};

/// The fast pass sums single-precision products of numbers below one over some thirty blocks; inner
/// edges, which it leaves out, cancel here to rounding only.
const ROUNDING: f64 = 2e-6;
const MAX_JUMP: f32 = 0.12;

/// Smooth inverse ranges with a jump, and holes wherever a hash says so.
fn pair(width: usize, height: usize, holes: u64) -> Pair {
    let smooth = |x: usize, y: usize| {
        let (x, y) = (x as f32, y as f32);
        let jump = if x > 0.6 * width as f32 { 0.3 } else { 0.0 };
        0.5 + 0.01 * (0.3 * x).sin() + 0.02 * (0.2 * y).cos() + jump
    };
    let mut pair = Pair::default();
    for y in 0..height {
        for x in 0..width {
            let hash = ((x * 7919 + y * 104_729) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 60;
            let hole = if hash < holes { f32::NAN } else { 0.0 };
            pair.mean.push(smooth(x, y) + hole);
            pair.half
                .push(0.01 * (0.1 * (x + 2 * y) as f32).sin() + hole);
        }
    }
    pair
}

struct Slow<'a> {
    grid: &'a SphereGrid,
    pair: &'a Pair,
}

impl Slow<'_> {
    fn at(&self, x: isize, y: isize) -> Option<(f64, f64)> {
        let (width, height) = (self.grid.width() as isize, self.grid.height() as isize);
        let x = if self.grid.wraps_around() {
            x.rem_euclid(width)
        } else {
            x
        };
        if !(0..width).contains(&x) || !(0..height).contains(&y) {
            return None;
        }
        let i = (y * width + x) as usize;
        let known = self.pair.mean[i].is_finite();
        known.then(|| (f64::from(self.pair.mean[i]), f64::from(self.pair.half[i])))
    }

    /// Value on the side of block `(x, y)` towards `(dx, dy)`.
    fn on_side(&self, x: isize, y: isize, dx: isize, dy: isize) -> (f64, f64) {
        let (mean, half) = self.at(x, y).unwrap();
        if let Some((next, next_half)) = self.at(x + dx, y + dy) {
            return (0.5 * (mean + next), 0.5 * (half + next_half));
        }
        match self.at(x - dx, y - dy) {
            Some((back, back_half)) if (mean - back).abs() <= f64::from(MAX_JUMP) * mean => {
                (1.5 * mean - 0.5 * back, 1.5 * half - 0.5 * back_half)
            }
            _ => (mean, half),
        }
    }

    /// Coefficients of `[omega, v]` of one block, from the definition.
    fn block(&self, x: usize, y: usize) -> [f64; 6] {
        let (xi, yi) = (x as isize, y as isize);
        let (mean, half) = self.at(xi, yi).unwrap();
        let square = |(mean, half): (f64, f64)| {
            let (first, second) = (mean - half, mean + half);
            0.5 * (first * first + second * second)
        };
        let mut omega = Vector3::zeros();
        let area = self.grid.solid_angle()[y * self.grid.width() + x];
        let mut v = self.grid.ray(x, y) * (2.0 * square((mean, half)) * area);
        let sides = [
            (self.grid.edge_x(x + 1, y), 1, 0, 1.0),
            (self.grid.edge_x(x, y), -1, 0, -1.0),
            (self.grid.edge_y(x, y + 1), 0, 1, 1.0),
            (self.grid.edge_y(x, y), 0, -1, -1.0),
        ];
        for (edge, dx, dy, outward) in sides {
            let value = self.on_side(xi, yi, dx, dy);
            omega += edge.tangent_length * (outward * value.0);
            v += edge.normal_length * (outward * 0.5 * square(value));
        }
        [omega.x, omega.y, omega.z, v.x, v.y, v.z]
    }
}

/// Thesis: eq. (6.2), eq. (6.3): one pass with shared edges equals the sum over every contour.
#[test]
fn accumulate_equals_a_loop_around_every_block() {
    let cameras = [
        Camera::pinhole(30.0, 32.0, 20.0, 14.0, 41, 30).unwrap(),
        Camera::equirectangular(48, 24).unwrap(),
    ];
    for camera in cameras {
        for holes in [0, 3] {
            let table = SphereTable::new(&camera, 1).unwrap();
            let grid = SphereGrid::new(&camera).unwrap();
            let tiling = Tiling::new(table.width, table.height, 40);
            let pair = pair(table.width, table.height, holes);
            let mut fast = Vec::new();
            WeakForm {
                table: &table,
                tiling: &tiling,
                pair: &pair,
                max_jump: MAX_JUMP,
            }
            .accumulate(&mut fast, &mut AreaIntegrals::default());
            let slow = Slow {
                grid: &grid,
                pair: &pair,
            };
            let mut sums = vec![[0.0; 6]; tiling.cells];
            for y in 0..table.height {
                for x in 0..table.width {
                    if slow.at(x as isize, y as isize).is_some() {
                        let cell = (tiling.row[y] + tiling.column[x]) as usize;
                        let block = slow.block(x, y);
                        (0..6).for_each(|k| sums[cell][k] += block[k]);
                    }
                }
            }
            for (fast, slow) in fast.iter().zip(&sums) {
                for (fast, slow) in fast.coefficients.iter().zip(slow) {
                    assert!((fast - slow).abs() < ROUNDING, "{fast} {slow}");
                }
            }
        }
    }
}
