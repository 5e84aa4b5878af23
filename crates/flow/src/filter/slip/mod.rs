//! How far the given step between two images is off, measured between warped images.
//!
//! Clocks that differ, a shutter that rolls and poses in error all turn and move the camera by more than is
//! told. What the state has made of earlier such errors must not be taken for new ones: a pixel says little
//! about the direction in which its own range would move it, so that, as in epipolar geometry, it is the
//! movement across it that counts.

mod equations;

use super::lattice::{Around, LensCall, read};
use super::lens::Lens;
use super::state::Node;
use super::update::{HIDES, Pair};
pub(super) use equations::{Known, Slip};
use equations::{MODES, SUMS, Sums, UNKNOWNS};
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

/// What a pixel counts for: chi is that of every third column and row.
const COUNTS: f32 = (COLUMNS * ROWS) as f32 / 9.0;

/// Where Huber's weight begins to fall, in standard deviations of the predicted residual.
const REACH: f32 = 2.0;

/// From the state's variance to the errors seen, as for the deviations that are put out.
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
        let rows: Vec<Sums> = (0..lattice.height.div_ceil(ROWS))
            .into_par_iter()
            .map(|row| {
                arch.dispatch(Row {
                    measure: &self,
                    lens,
                    y: (row * ROWS + ROWS / 2).min(lattice.height - 1),
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

/// Pixels that are worked on together.
const TOGETHER: usize = 64;

/// One row, compiled for wide vectors.
struct Row<'a, 'b, 'c, L: Lens> {
    measure: &'a MeasureSlip<'b, 'c>,
    lens: &'a L,
    y: usize,
}

impl<L: Lens> pulp::WithSimd for Row<'_, '_, '_, L> {
    type Output = Sums;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Sums {
        let width = self.measure.pair.lattice.width;
        let end = (self.y + 1) * width;
        let mut first = self.y * width + self.y / ROWS % COLUMNS;
        let mut lanes = [[0.0; LANES]; SUMS];
        while first < end {
            let count = (end - first).div_ceil(COLUMNS).min(TOGETHER);
            let mut block = Block::new();
            block.place(self.lens, self.measure, first, count);
            block.read(self.measure, count);
            block.judge(self.measure.pair, self.y);
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
    /// Movement of the place as the point times zeta moves along each axis.
    moved: [[Each; 2]; 3],
    past: [[f32; 4]; TOGETHER],
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
            moved: [[zero; 2]; 3],
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
            for (moved, axis) in self.moved.iter_mut().zip(&axes) {
                let (place, along) = lens.project_along(&there, axis);
                (self.place[0][i], self.place[1][i]) = (place[0], place[1]);
                (moved[0][i], moved[1][i]) = (along[0], along[1]);
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
    fn judge(&mut self, pair: &Pair<'_>, y: usize) {
        let gain = pair.gain[y];
        let noise = pair.new.sigma.powi(2) + (gain * pair.past.sigma).powi(2);
        let step = pair.step.translation;
        for i in 0..TOGETHER {
            let [value, gx, gy, _] = self.past[i].map(|value| gain * value);
            let residual = value - self.new[i];
            let (zeta, variance) = (self.zeta[i], self.variance[i]);
            let moved = |c: usize| Vector3::from_fn(|k, _| self.moved[k][c][i]);
            let (right, down) = (moved(0), moved(1));
            // By the point times zeta, by zeta.
            let by_point = right * gx + down * gy;
            let by_zeta = by_point.dot(&step);
            let span2 = right.dot(&step).powi(2) + down.dot(&step).powi(2);
            let free = STATE * variance + FREE * FREE * zeta * zeta;
            let expected2 = noise + by_zeta * by_zeta * free;
            let size2 = residual * residual;
            let reach2 = REACH * REACH * expected2;
            let fits = if size2 > reach2 { reach2 / size2 } else { 1.0 };
            let off = 1.0 + variance * span2 / (DOUBT_PX * DOUBT_PX);
            let weight = COUNTS * fits.sqrt() / (expected2 * off * off);
            let there = Vector3::from_fn(|k, _| self.there[k][i]);
            let turned = there.cross(&by_point);
            let shared = Vector3::from_fn(|k, _| by_zeta * self.ray[k][i]);
            let usable = (weight * (residual + turned.sum() + by_zeta)).is_finite();
            for k in 0..3 {
                let slopes = [turned[k], zeta * by_point[k], zeta * shared[k], shared[k]];
                for (mode, slope) in (0..MODES).zip(slopes) {
                    self.slopes[3 * mode + k][i] = if usable { slope } else { 0.0 };
                }
            }
            self.residual[i] = if usable { residual } else { 0.0 };
            self.weight[i] = if usable { weight } else { 0.0 };
        }
    }

    /// Adds to sums of every so many pixels, each a lane of a vector.
    #[inline(always)]
    fn gather(&self, sums: &mut [[f32; LANES]; SUMS]) {
        for first in (0..TOGETHER).step_by(LANES) {
            let lane = |of: &Each| -> [f32; LANES] { std::array::from_fn(|i| of[first + i]) };
            let (weight, residual) = (lane(&self.weight), lane(&self.residual));
            let slopes: [[f32; LANES]; UNKNOWNS] = std::array::from_fn(|k| lane(&self.slopes[k]));
            let mut next = 0;
            for i in 0..UNKNOWNS {
                let weighted: [f32; LANES] = std::array::from_fn(|k| weight[k] * slopes[i][k]);
                for other in slopes[i..].iter().chain([&residual]) {
                    for k in 0..LANES {
                        sums[next][k] += weighted[k] * other[k];
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
mod tests {
    use super::*;
    use crate::filter::lattice::Lattice;
    use crate::filter::predict::Step;
    use crate::filter::prepare::{Preparation, Prepared};
    use crate::filter::state::Drift;
    use nalgebra::Rotation3;
    use sphereflow_core::Plane;
    use sphereflow_sphere::Camera;

    const WIDTH: usize = 160;
    const HEIGHT: usize = 120;
    const FOCAL_PX: f64 = 150.0;
    /// The painted wall stands this far before the past camera, metres.
    const WALL_M: f64 = 2.0;

    /// Smoothing at borders and reading between pixels leave a hundredth of a pixel or two.
    const OFF_PX: f64 = 0.03;

    /// The movement that is to be found, pixels in the middle of the image.
    const MISSING_PX: f64 = 0.5;

    /// Before a wall movements and turns look alike: a fifth of what is missing may be taken for the other.
    const ALIKE_PX: f64 = 0.1;

    /// What is clear to the filter in 640x480 (60), of a quarter of its pixels.
    const CLEAR: f64 = 15.0;

    /// What is known of poses before, rad and metres.
    const TOLD: Drift = Drift {
        rotation: 1e-4,
        translation: 4e-4,
    };

    fn camera() -> Camera {
        Camera::pinhole(FOCAL_PX, FOCAL_PX, 79.5, 59.5, WIDTH, HEIGHT).unwrap()
    }

    fn paint(x: f64, y: f64) -> f32 {
        let waves = (9.0 * x + 3.0 * y).sin() + (7.0 * y - 2.0 * x).sin() + (5.0 * (x + y)).sin();
        (128.0 + 35.0 * waves) as f32
    }

    /// What a camera sees of the wall, and its inverse depth there; `X_past = rotation X + place`.
    fn view(
        lattice: &Lattice,
        rotation: &Rotation3<f64>,
        place: &Vector3<f64>,
    ) -> (Plane<f32>, Vec<Node>) {
        let mut nodes = Vec::with_capacity(lattice.ray.len());
        let image = Plane::from_fn(WIDTH, HEIGHT, |x, y| {
            let along = rotation * lattice.ray[y * WIDTH + x].cast::<f64>();
            let depth = (WALL_M - place.z) / along.z;
            let point = along * depth + place;
            nodes.push([(1.0 / depth) as f32, 0.0, 1e6, 1e-8]);
            paint(point.x, point.y)
        });
        (image, nodes)
    }

    /// What is measured where the step lacks a movement of the past camera, and ranges are off by a factor.
    fn measure(turned: &Rotation3<f64>, moved: &Vector3<f64>, factor: f32, told: Drift) -> Slip {
        let lattice = Lattice::new(&camera()).unwrap();
        let rotation = Rotation3::new(Vector3::new(0.02, -0.03, 0.5));
        let place = Vector3::new(0.06, -0.04, 0.03);
        let (past, _) = view(&lattice, &Rotation3::identity(), &Vector3::zeros());
        let (new, mut nodes) = view(&lattice, &rotation, &place);
        nodes.iter_mut().for_each(|node| node[0] /= factor);
        let mut preparation = Preparation::new(WIDTH, HEIGHT, 1);
        let mut prepare =
            |image| preparation.prepare(image, &lattice, Some(1.0), Prepared::empty());
        let (past, new) = (prepare(&past), prepare(&new));
        let pair = Pair {
            lattice: &lattice,
            step: Step {
                rotation: (turned.inverse() * rotation).matrix().cast(),
                translation: (turned.inverse() * (place - moved)).cast(),
            },
            new: &new,
            past: &past,
            surface: &[],
            gain: vec![1.0; HEIGHT],
            drift: told,
        };
        let known = Known::of(&pair, 1.0 / WALL_M);
        lattice.lens.with(MeasureSlip {
            pair: &pair,
            nodes: &nodes,
            known,
        })
    }

    fn axes() -> [Vector3<f64>; 4] {
        let slanted = Vector3::new(0.6, -0.48, 0.64);
        [Vector3::x(), Vector3::y(), Vector3::z(), slanted]
    }

    #[test]
    fn slip_of_exact_data_is_none() {
        for told in [Drift::default(), TOLD] {
            let slip = measure(&Rotation3::identity(), &Vector3::zeros(), 1.0, told);
            assert!(slip.rotation().norm() * FOCAL_PX < OFF_PX, "{slip:?}");
            assert!(slip.place().norm() / WALL_M * FOCAL_PX < OFF_PX, "{slip:?}");
        }
    }

    #[test]
    fn slip_of_a_missing_movement_is_told_apart_from_ranges_that_are_off_by_a_tenth() {
        let missing = Vector3::new(0.6, 0.8, 0.0) * MISSING_PX / FOCAL_PX * WALL_M;
        for factor in [1.0, 1.1] {
            let slip = measure(&Rotation3::identity(), &missing, factor, TOLD);
            let place = slip.place();
            // Along the step it is the ranges that move as well.
            let along = Vector3::new(0.06, -0.04, 0.0).normalize();
            let across = along.cross(&Vector3::z());
            let off_px = (place - missing).dot(&across) / WALL_M * FOCAL_PX;
            let turned_px = slip.rotation().norm() * FOCAL_PX;
            assert!(off_px.abs() < ALIKE_PX, "{factor}: {slip:?}, {off_px}");
            assert!(turned_px < ALIKE_PX, "{factor}: {slip:?}, {turned_px}");
        }
    }

    #[test]
    fn slip_of_a_missing_rotation_is_that_rotation_in_the_past_camera() {
        let size = MISSING_PX / FOCAL_PX;
        for axis in axes() {
            for sign in [1.0, -1.0] {
                let missing = axis * sign * size;
                let none = Vector3::zeros();
                let slip = measure(&Rotation3::new(missing), &none, 1.0, Drift::default());
                let off_px = (slip.rotation() - missing).norm() * FOCAL_PX;
                assert!(off_px < OFF_PX, "{missing:?}: {slip:?}, {off_px}");
                assert!(slip.chi > CLEAR, "{missing:?}: {slip:?}");
            }
        }
    }
}
