//! How far the given rotation between two images is off, measured between warped images.
//!
//! Clocks that differ, a shutter that rolls and poses in error all turn the camera by more than is told. Over
//! a whole image a rotation is told from the state's errors to hundredths of a pixel, so that exact poses are
//! left alone, and errors of others are known.

use super::lattice::{Around, LensCall, read};
use super::lens::Lens;
use super::state::Node;
use super::update::{HIDES, Pair};
use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};
use rayon::prelude::*;

/// Measures the small rotation (in the past camera, rad) that is missing in a pair's step.
pub(super) struct MeasureTurn<'a, 'b> {
    pub pair: &'a Pair<'b>,
    pub nodes: &'a [Node],
}

/// A rotation, and its squared size over its variance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn {
    pub angle: Vector3<f64>,
    pub chi: f64,
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

/// Ranges share no larger relative error than this.
const SCALE: f64 = 0.1;

/// Rotations beyond this are not small, pixels in the middle of the image.
const LARGEST_PX: f64 = 10.0;

impl LensCall<Turn> for MeasureTurn<'_, '_> {
    fn call<L: Lens>(self, lens: &L) -> Turn {
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
        all.solve(most).unwrap_or(Turn::NONE)
    }
}

impl Turn {
    const NONE: Self = Self {
        angle: Vector3::new(0.0, 0.0, 0.0),
        chi: 0.0,
    };
}

/// Pixels that are worked on together.
const TOGETHER: usize = 64;

/// One row, compiled for wide vectors.
struct Row<'a, 'b, 'c, L: Lens> {
    measure: &'a MeasureTurn<'b, 'c>,
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

/// Pixels of a row: what a rotation about each axis, and a common change of all ranges, does to their residuals.
struct Block {
    zeta: [f32; TOGETHER],
    variance: [f32; TOGETHER],
    new: [f32; TOGETHER],
    there: [[f32; TOGETHER]; 3],
    place: [[f32; TOGETHER]; 2],
    along: [[f32; TOGETHER]; 2],
    /// Movement of the place by a rotation about each axis.
    turned: [[[f32; TOGETHER]; 2]; 3],
    past: [[f32; 4]; TOGETHER],
    slopes: [[f32; TOGETHER]; 4],
    residual: [f32; TOGETHER],
    /// Zero where there is nothing to be compared.
    weight: [f32; TOGETHER],
}

impl Block {
    #[inline(always)]
    fn new() -> Self {
        Self {
            zeta: [f32::NAN; TOGETHER],
            variance: [0.0; TOGETHER],
            new: [0.0; TOGETHER],
            there: [[f32::NAN; TOGETHER]; 3],
            place: [[f32::NAN; TOGETHER]; 2],
            along: [[0.0; TOGETHER]; 2],
            turned: [[[0.0; TOGETHER]; 2]; 3],
            past: [[f32::NAN; 4]; TOGETHER],
            slopes: [[0.0; TOGETHER]; 4],
            residual: [0.0; TOGETHER],
            weight: [0.0; TOGETHER],
        }
    }

    #[inline(always)]
    fn place<L: Lens>(&mut self, lens: &L, of: &MeasureTurn<'_, '_>, first: usize, count: usize) {
        let step = &of.pair.step;
        for i in 0..count {
            let here = first + i * COLUMNS;
            let node = &of.nodes[here];
            (self.zeta[i], self.variance[i]) = (node[0], node[3]);
            self.new[i] = of.pair.new.pixel[here][0];
            let there = step.rotation * of.pair.lattice.ray[here] + step.translation * node[0];
            (0..3).for_each(|k| self.there[k][i] = there[k]);
        }
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        for i in 0..count {
            let there = Vector3::new(self.there[0][i], self.there[1][i], self.there[2][i]);
            let (place, along) = lens.project_along(&there, &step.translation);
            (self.place[0][i], self.place[1][i]) = (place[0], place[1]);
            (self.along[0][i], self.along[1][i]) = (along[0], along[1]);
            for (turned, axis) in self.turned.iter_mut().zip(&axes) {
                let (_, moved) = lens.project_along(&there, &axis.cross(&there));
                (turned[0][i], turned[1][i]) = (moved[0], moved[1]);
            }
            // From here on the gauge is all that is asked for.
            self.there[2][i] = lens.gauge(&there);
        }
    }

    #[inline(always)]
    fn read(&mut self, of: &MeasureTurn<'_, '_>, count: usize) {
        let (pair, width) = (of.pair, of.pair.lattice.width);
        let mut around = Around::new();
        pair.lattice.around_each(&self.place, &mut around);
        for i in 0..count {
            let nearest = around.nearest[i] as usize;
            let surface = pair.surface.get(nearest).copied().unwrap_or(0.0);
            let hidden = surface * self.there[2][i] > HIDES * self.zeta[i];
            let across = if hidden { f32::NAN } else { around.across[i] };
            let four = around.four(width, i);
            self.past[i] = read(&pair.past.pixel, four, across, around.down[i]);
        }
    }

    #[inline(always)]
    fn judge(&mut self, pair: &Pair<'_>, y: usize) {
        let gain = pair.gain[y];
        let noise = pair.new.sigma.powi(2) + (gain * pair.past.sigma).powi(2);
        for i in 0..TOGETHER {
            let [value, gx, gy, _] = self.past[i].map(|value| gain * value);
            let residual = value - self.new[i];
            // What the state does not know of the range is not the rotation's.
            let slope = gx * self.along[0][i] + gy * self.along[1][i];
            let expected2 = noise + STATE * slope * slope * self.variance[i];
            let size2 = residual * residual;
            let reach2 = REACH * REACH * expected2;
            let fits = if size2 > reach2 { reach2 / size2 } else { 1.0 };
            let weight = COUNTS * fits.sqrt() / expected2;
            let turned = |k: usize| gx * self.turned[k][0][i] + gy * self.turned[k][1][i];
            let slopes = [turned(0), turned(1), turned(2), slope * self.zeta[i]];
            let usable = (weight * residual * slopes.iter().sum::<f32>()).is_finite();
            for (all, slope) in self.slopes.iter_mut().zip(slopes) {
                all[i] = if usable { slope } else { 0.0 };
            }
            self.residual[i] = if usable { residual } else { 0.0 };
            self.weight[i] = if usable { weight } else { 0.0 };
        }
    }

    /// Adds to sums of every so many pixels, each a lane of a vector.
    #[inline(always)]
    fn gather(&self, sums: &mut [[f32; LANES]; SUMS]) {
        for first in (0..TOGETHER).step_by(LANES) {
            let lane =
                |of: &[f32; TOGETHER]| -> [f32; LANES] { std::array::from_fn(|i| of[first + i]) };
            let (weight, residual) = (lane(&self.weight), lane(&self.residual));
            let slopes: [[f32; LANES]; 4] = std::array::from_fn(|k| lane(&self.slopes[k]));
            let mut next = 0;
            for i in 0..4 {
                for j in i..5 {
                    let other = if j < 4 { &slopes[j] } else { &residual };
                    for k in 0..LANES {
                        sums[next][k] += weight[k] * slopes[i][k] * other[k];
                    }
                    next += 1;
                }
            }
        }
    }
}

/// Lanes of a vector.
const LANES: usize = 8;

/// Numbers of the normal equations.
const SUMS: usize = 14;

/// Normal equations of the rotation and of the relative error that all ranges share: what looks like the
/// latter is not a rotation. Rows of the upper half of the matrix, each followed by its number of the right side.
#[derive(Clone, Copy, Debug, Default)]
struct Sums([f32; SUMS]);

impl Sums {
    fn add(&mut self, other: &Self) {
        for (sum, value) in self.0.iter_mut().zip(other.0) {
            *sum += value;
        }
    }

    /// `None` where the images do not say.
    fn solve(&self, most: f64) -> Option<Turn> {
        /// Where the rows begin.
        const ROW: [usize; 4] = [0, 5, 9, 12];
        let at = |i: usize, j: usize| f64::from(self.0[ROW[i] + j - i]);
        let mut matrix = Matrix4::from_fn(|i, j| at(i.min(j), i.max(j)));
        let vector = Vector4::from_fn(|i, _| at(i, 4));
        let prior = [most, most, most, SCALE];
        matrix += Matrix4::from_diagonal(&Vector4::from(prior.map(|sigma| sigma.powi(-2))));
        let inverse = matrix.try_inverse()?;
        let found = -(inverse * vector);
        let covariance: Matrix3<f64> = inverse.fixed_view::<3, 3>(0, 0).into();
        let angle = found.xyz();
        let chi = angle.dot(&(covariance.try_inverse()? * angle));
        let small = angle.norm() < most && chi.is_finite();
        small.then_some(Turn { angle, chi })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to
mod tests {
    use super::*;
    use crate::filter::lattice::Lattice;
    use crate::filter::predict::Step;
    use crate::filter::prepare::{Preparation, Prepared};
    use nalgebra::Rotation3;
    use sphereflow_core::Plane;
    use sphereflow_sphere::Camera;

    const WIDTH: usize = 160;
    const HEIGHT: usize = 120;
    const FOCAL_PX: f64 = 150.0;
    /// The painted wall stands this far before the past camera, metres.
    const WALL_M: f64 = 2.0;

    /// Smoothing at borders and reading between pixels leave a hundredth of a pixel or two: half of what the
    /// filter leaves alone.
    const OFF_PX: f64 = 0.025;

    /// What is found where nothing is missing is less than its own standard deviation.
    const WITHIN: f64 = 1.0;

    /// The rotation that is to be found, pixels in the middle of the image.
    const MISSING_PX: f64 = 0.5;

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

    /// What is measured where the step lacks a rotation, as one of the past camera.
    fn measure(missing: &Rotation3<f64>) -> Turn {
        let lattice = Lattice::new(&camera()).unwrap();
        // Rolled by half a radian: an axis of the new camera is not one of the past camera.
        let rotation = Rotation3::new(Vector3::new(0.02, -0.03, 0.5));
        let place = Vector3::new(0.06, -0.04, 0.03);
        let (past, _) = view(&lattice, &Rotation3::identity(), &Vector3::zeros());
        let (new, nodes) = view(&lattice, &rotation, &place);
        let mut preparation = Preparation::new(WIDTH, HEIGHT, 1);
        let mut prepare =
            |image| preparation.prepare(image, &lattice, Some(1.0), Prepared::empty());
        let (past, new) = (prepare(&past), prepare(&new));
        let pair = Pair {
            lattice: &lattice,
            step: Step {
                rotation: (missing.inverse() * rotation).matrix().cast(),
                translation: (missing.inverse() * place).cast(),
            },
            new: &new,
            past: &past,
            surface: &[],
            gain: vec![1.0; HEIGHT],
            drift: crate::filter::state::Drift::default(),
        };
        lattice.lens.with(MeasureTurn {
            pair: &pair,
            nodes: &nodes,
        })
    }

    #[test]
    fn turn_of_exact_data_is_none() {
        let turn = measure(&Rotation3::identity());
        assert!(turn.angle.norm() * FOCAL_PX < OFF_PX, "{turn:?}");
        assert!(turn.chi < WITHIN, "{turn:?}");
    }

    #[test]
    fn turn_of_a_missing_rotation_is_that_rotation_in_the_past_camera() {
        let size = MISSING_PX / FOCAL_PX;
        for axis in [
            Vector3::x(),
            Vector3::y(),
            Vector3::z(),
            Vector3::new(0.6, -0.48, 0.64),
        ] {
            for sign in [1.0, -1.0] {
                let missing = axis * sign * size;
                let turn = measure(&Rotation3::new(missing));
                let off_px = (turn.angle - missing).norm() * FOCAL_PX;
                assert!(off_px < OFF_PX, "{missing:?}: {turn:?}, {off_px}");
                assert!(turn.chi > 100.0, "{missing:?}: {turn:?}");
            }
        }
    }
}
