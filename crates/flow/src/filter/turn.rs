//! How far the given rotation between two images is off, measured between warped images.
//!
//! Clocks that differ, a shutter that rolls and poses in error all turn the camera by more than is told. Over
//! a whole image a rotation is told from the state's errors to hundredths of a pixel, so that exact poses are
//! left alone, and errors of others are known.

use super::lattice::{LensCall, mix};
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

/// Every so many columns and rows are enough.
const STEP: usize = 3;

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
        let rows: Vec<Sums> = (0..lattice.height / STEP)
            .into_par_iter()
            .map(|row| {
                arch.dispatch(Row {
                    measure: &self,
                    lens,
                    y: row * STEP,
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
        let (pair, y, lens) = (self.measure.pair, self.y, self.lens);
        let (lattice, gain, step) = (pair.lattice, pair.gain[y], &pair.step);
        let noise = pair.new.sigma.powi(2) + (gain * pair.past.sigma).powi(2);
        let mut sums = Sums::default();
        for x in (y / STEP % STEP..lattice.width).step_by(STEP) {
            let here = y * lattice.width + x;
            let node = &self.measure.nodes[here];
            let there = step.rotation * lattice.ray[here] + step.translation * node[0];
            let (place, along) = lens.project_along(&there, &step.translation);
            let Some((four, s, t)) = lattice.around(place) else {
                continue;
            };
            if !pair.surface.is_empty() {
                let nearest = four[usize::from(s > 0.5) + 2 * usize::from(t > 0.5)];
                if pair.surface[nearest] * lens.gauge(&there) > HIDES * node[0] {
                    continue;
                }
            }
            let [value, gx, gy, _] = mix(&pair.past.pixel, four, s, t);
            let residual = gain * value - pair.new.pixel[here][0];
            let (gx, gy) = (gain * gx, gain * gy);
            let turned = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| {
                let (_, moved) = lens.project_along(&there, &axis.cross(&there));
                gx * moved[0] + gy * moved[1]
            });
            // What the state does not know of the range is not the rotation's.
            let slope = gx * along[0] + gy * along[1];
            let expected2 = noise + STATE * slope * slope * node[3];
            let size2 = residual * residual;
            let reach2 = REACH * REACH * expected2;
            let fits = if size2 > reach2 {
                (reach2 / size2).sqrt()
            } else {
                1.0
            };
            let weight = fits / expected2;
            let slopes = [turned[0], turned[1], turned[2], slope * node[0]];
            let usable = (weight * residual * slopes.iter().sum::<f32>()).is_finite();
            if usable {
                sums.gather(slopes, residual, weight);
            }
        }
        sums
    }
}

/// Normal equations of the rotation and of the relative error that all ranges share: what looks like the
/// latter is not a rotation.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    matrix: [[f32; 4]; 4],
    vector: [f32; 4],
}

impl Sums {
    #[inline(always)]
    fn gather(&mut self, j: [f32; 4], residual: f32, weight: f32) {
        for (i, row) in self.matrix.iter_mut().enumerate() {
            let weighted = weight * j[i];
            for (sum, j) in row.iter_mut().zip(j) {
                *sum += weighted * j;
            }
            self.vector[i] += weighted * residual;
        }
    }

    fn add(&mut self, other: &Self) {
        for (row, other) in self.matrix.iter_mut().zip(&other.matrix) {
            for (sum, value) in row.iter_mut().zip(other) {
                *sum += value;
            }
        }
        for (sum, value) in self.vector.iter_mut().zip(other.vector) {
            *sum += value;
        }
    }

    /// `None` where the images do not say.
    fn solve(&self, most: f64) -> Option<Turn> {
        let mut matrix = Matrix4::from_fn(|i, j| f64::from(self.matrix[i][j]));
        let prior = [most, most, most, SCALE];
        matrix += Matrix4::from_diagonal(&Vector4::from(prior.map(|sigma| sigma.powi(-2))));
        let inverse = matrix.try_inverse()?;
        let found = -(inverse * Vector4::from(self.vector.map(f64::from)));
        let covariance: Matrix3<f64> = inverse.fixed_view::<3, 3>(0, 0).into();
        let angle = found.xyz();
        let chi = angle.dot(&(covariance.try_inverse()? * angle));
        let small = angle.norm() < most && chi.is_finite();
        small.then_some(Turn { angle, chi })
    }
}
