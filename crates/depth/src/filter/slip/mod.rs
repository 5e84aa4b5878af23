//! How far the given step between two images is off, measured between warped images.
//!
//! Clocks that differ, a shutter that rolls and poses in error all turn and move the camera by more than is
//! told. What the state has made of earlier such errors must not be taken for new ones: a pixel says little
//! about the direction in which its own range would move it, so that, as in epipolar geometry, it is the
//! movement across it that counts.

mod equations;

use super::lattice::{Around, LensCall, TOGETHER, read};
use super::lens::Lens;
use super::pair::Pair;
use super::state::Node;
use super::surfaces::HIDES;
pub(super) use equations::{Known, Slip};
use equations::{SUMS, Sums, UNKNOWNS};
use nalgebra::Vector3;
use rayon::prelude::*;

/// Measures the small movement (of points in the past camera) that is missing in a pair's step.
pub(super) struct MeasureSlip<'a, 'b> {
    pub pair: &'a Pair<'b>,
    pub nodes: &'a [Node],
    pub known: Known,
}

/// Every so many columns, and rows, are enough. Rows are what costs: their pixels share cache lines.
const COLUMNS: usize = 2;
const ROWS: usize = 8;

/// Rows where it is only asked whether poses that are told to be exact are not.
const ROWS_OF_EXACT: usize = 16;

/// Columns and rows by which what a pixel counts for is told: chi is that of every third.
const COUNTED: usize = 9;

/// Where Huber's weight begins to fall, in standard deviations of the predicted residual.
const REACH: f32 = 2.0;

/// The state's variance counts this many times: it is that of a state whose poses were exact.
const STATE: f32 = 4.0;

/// Each pixel's inverse range is taken for known to this many times itself, whatever the state says: its
/// errors are those of many pixels, and would outvote what moves across.
const FREE: f32 = 2.0;

/// Doubt about a pixel's place, in pixels, beyond which slopes of the image there say nothing.
const DOUBT_PX: f32 = 0.5;

/// Movements beyond this are not small, pixels in the middle of the image.
pub(super) const LARGEST_PX: f64 = 10.0;

impl LensCall<Slip> for MeasureSlip<'_, '_> {
    fn call<L: Lens>(self, lens: &L) -> Slip {
        let lattice = self.pair.lattice;
        let arch = pulp::Arch::new();
        let every = if self.known.told { ROWS } else { ROWS_OF_EXACT };
        let rows: Vec<Sums> = (0..lattice.height.div_ceil(every))
            .into_par_iter()
            .map(|row| {
                arch.dispatch(Row {
                    measure: &self,
                    lens,
                    y: (row * every + every / 2).min(lattice.height - 1),
                    every,
                })
            })
            .collect();
        let mut all = Sums::default();
        rows.iter().for_each(|row| all.add(row));
        let most = LARGEST_PX / f64::from(lattice.focal_px);
        let slip = all.solve(&self.known);
        slip.filter(|slip| slip.rotation().norm() < most)
            .unwrap_or(Slip::NONE)
    }
}

/// One row, compiled for wide vectors.
struct Row<'a, 'b, 'c, L: Lens> {
    measure: &'a MeasureSlip<'b, 'c>,
    lens: &'a L,
    y: usize,
    /// Rows that it stands for.
    every: usize,
}

impl<L: Lens> pulp::WithSimd for Row<'_, '_, '_, L> {
    type Output = Sums;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Sums {
        let width = self.measure.pair.lattice.width;
        let end = (self.y + 1) * width;
        let mut first = self.y * width + self.y / self.every % COLUMNS;
        let counts = (COLUMNS * self.every) as f32 / COUNTED as f32;
        let mut lanes = [[0.0; LANES]; SUMS];
        while first < end {
            let count = (end - first).div_ceil(COLUMNS).min(TOGETHER);
            let mut block = Block::new();
            block.place(self.lens, self.measure, first, count);
            block.read(self.measure, count);
            block.judge(self.measure.pair, self.y, counts);
            block.gather(&mut lanes);
            first += count * COLUMNS;
        }
        Sums(lanes.map(|lane| lane.iter().sum()))
    }
}

/// A number of each of the pixels.
type Each = [f32; TOGETHER];

/// Pixels of a row: what a movement of the camera, and errors of all ranges, do to their residuals.
struct Block {
    zeta: Each,
    variance: Each,
    new: Each,
    ray: [Each; 3],
    /// The point times zeta, in the past camera.
    there: [Each; 3],
    gauge: Each,
    place: [Each; 2],
    /// Movement of the place, right and down, as the point times zeta moves along each axis.
    moved: [[Each; 3]; 2],
    past: [[f32; 4]; TOGETHER],
    /// Of the image.
    slope: [Each; 2],
    slopes: [Each; UNKNOWNS],
    residual: Each,
    /// Zero where there is nothing to be compared.
    weight: Each,
}

impl Block {
    #[inline(always)]
    fn new() -> Self {
        let (nothing, zero) = ([f32::NAN; TOGETHER], [0.0; TOGETHER]);
        Self {
            zeta: nothing,
            variance: zero,
            new: nothing,
            ray: [zero; 3],
            there: [nothing; 3],
            gauge: zero,
            place: [nothing; 2],
            moved: [[zero; 3]; 2],
            slope: [zero; 2],
            past: [[f32::NAN; 4]; TOGETHER],
            slopes: [zero; UNKNOWNS],
            residual: zero,
            weight: zero,
        }
    }

    #[inline(always)]
    fn place<L: Lens>(&mut self, lens: &L, of: &MeasureSlip<'_, '_>, first: usize, count: usize) {
        let step = &of.pair.step;
        for i in 0..count {
            let here = first + i * COLUMNS;
            let node = &of.nodes[here];
            (self.zeta[i], self.variance[i]) = (node[0], node[3]);
            self.new[i] = of.pair.new.pixel[here][0];
            let ray = of.pair.lattice.ray[here];
            let there = step.rotation * ray + step.translation * node[0];
            for k in 0..3 {
                (self.ray[k][i], self.there[k][i]) = (ray[k], there[k]);
            }
        }
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        for i in 0..count {
            let there = Vector3::new(self.there[0][i], self.there[1][i], self.there[2][i]);
            for (k, axis) in axes.iter().enumerate() {
                let (place, along) = lens.project_along(&there, axis);
                (self.place[0][i], self.place[1][i]) = (place[0], place[1]);
                (self.moved[0][k][i], self.moved[1][k][i]) = (along[0], along[1]);
            }
            self.gauge[i] = lens.gauge(&there);
        }
    }

    #[inline(always)]
    fn read(&mut self, of: &MeasureSlip<'_, '_>, count: usize) {
        let (pair, width) = (of.pair, of.pair.lattice.width);
        let mut around = Around::new();
        pair.lattice.around_each(&self.place, &mut around);
        for i in 0..count {
            let nearest = around.nearest[i] as usize;
            let surface = pair.surface.get(nearest).copied().unwrap_or(0.0);
            let hidden = surface * self.gauge[i] > HIDES * self.zeta[i];
            let across = if hidden { f32::NAN } else { around.across[i] };
            let four = around.four(width, i);
            self.past[i] = read(&pair.past.pixel, four, across, around.down[i]);
        }
    }

    #[inline(always)]
    fn judge(&mut self, pair: &Pair<'_>, y: usize, counts: f32) {
        let gain = pair.gain[y];
        let noise = pair.new.sigma.powi(2) + (gain * pair.past.sigma).powi(2);
        let step = pair.step.translation;
        for i in 0..TOGETHER {
            let [value, gx, gy, _] = self.past[i];
            self.residual[i] = gain * value - self.new[i];
            (self.slope[0][i], self.slope[1][i]) = (gain * gx, gain * gy);
        }
        for i in 0..TOGETHER {
            let (zeta, variance, residual) = (self.zeta[i], self.variance[i], self.residual[i]);
            let ([x, y], [there_x, there_y, there_z]) = (&self.moved, &self.there);
            let (gx, gy) = (self.slope[0][i], self.slope[1][i]);
            // By the point times zeta, by zeta.
            let by_x = gx * x[0][i] + gy * y[0][i];
            let by_y = gx * x[1][i] + gy * y[1][i];
            let by_z = gx * x[2][i] + gy * y[2][i];
            let by_zeta = by_x * step.x + by_y * step.y + by_z * step.z;
            let right = x[0][i] * step.x + x[1][i] * step.y + x[2][i] * step.z;
            let down = y[0][i] * step.x + y[1][i] * step.y + y[2][i] * step.z;
            let free = STATE * variance + FREE * FREE * zeta * zeta;
            let expected2 = noise + by_zeta * by_zeta * free;
            let size2 = residual * residual;
            let reach2 = REACH * REACH * expected2;
            let fits = if size2 > reach2 { reach2 / size2 } else { 1.0 };
            let off =
                1.0 + variance * (right * right + down * down) * (1.0 / (DOUBT_PX * DOUBT_PX));
            let weight = counts * fits.sqrt() / (expected2 * off * off);
            let turned = [
                there_y[i] * by_z - there_z[i] * by_y,
                there_z[i] * by_x - there_x[i] * by_z,
                there_x[i] * by_y - there_y[i] * by_x,
            ];
            let of_all = weight * (residual + turned[0] + turned[1] + turned[2] + by_zeta);
            let usable = of_all.abs() < f32::INFINITY;
            let keep = |value: f32| if usable { value } else { 0.0 };
            self.slopes[0][i] = keep(turned[0]);
            self.slopes[1][i] = keep(turned[1]);
            self.slopes[2][i] = keep(turned[2]);
            self.slopes[3][i] = keep(zeta * by_x);
            self.slopes[4][i] = keep(zeta * by_y);
            self.slopes[5][i] = keep(zeta * by_z);
            self.slopes[9][i] = keep(by_zeta * self.ray[0][i]);
            self.slopes[10][i] = keep(by_zeta * self.ray[1][i]);
            self.slopes[11][i] = keep(by_zeta * self.ray[2][i]);
            self.residual[i] = keep(residual);
            self.weight[i] = keep(weight);
        }
        for k in 0..3 {
            for i in 0..TOGETHER {
                let zeta = self.zeta[i];
                let usable = self.weight[i] > 0.0;
                self.slopes[6 + k][i] = if usable {
                    zeta * self.slopes[9 + k][i]
                } else {
                    0.0
                };
            }
        }
    }

    /// Adds to sums of every so many pixels, each a lane of a vector.
    #[inline(always)]
    fn gather(&self, sums: &mut [[f32; LANES]; SUMS]) {
        for first in (0..TOGETHER).step_by(LANES) {
            let mut lanes = [[0.0; LANES]; UNKNOWNS + 1];
            for (lanes, all) in lanes.iter_mut().zip(&self.slopes) {
                lanes.copy_from_slice(&all[first..first + LANES]);
            }
            lanes[UNKNOWNS].copy_from_slice(&self.residual[first..first + LANES]);
            let mut weight = [0.0; LANES];
            weight.copy_from_slice(&self.weight[first..first + LANES]);
            let mut next = 0;
            for i in 0..UNKNOWNS {
                let mut weighted = [0.0; LANES];
                for k in 0..LANES {
                    weighted[k] = weight[k] * lanes[i][k];
                }
                for lane in &lanes[i..] {
                    for k in 0..LANES {
                        sums[next][k] += weighted[k] * lane[k];
                    }
                    next += 1;
                }
            }
        }
    }
}

/// Lanes of a vector.
const LANES: usize = 8;

#[cfg(test)]
#[allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to
mod tests;
