//! How far the given rotation between two images is off, measured between warped images.
//!
//! Clocks that differ, a shutter that rolls and poses in error all turn the camera by more than is told. Over
//! a whole image a rotation is told from the state's errors to hundredths of a pixel, so that exact poses are
//! left alone, and errors of others are known.

use super::lattice::{LensCall, read};
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
            let [value, gx, gy, _] = read(&pair.past.pixel, four, s, t);
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
