//! The warp on an image plane, in single precision and so many pixels at once.

use super::Warp;
use crate::plane_projection::PlaneProjection;
use crate::row_motion::{Rigid, RowMotion};

/// Pixels at once.
const LANES: usize = 16;

type Lanes = [f32; LANES];

/// One row of the image to fill.
pub(super) struct PlaneRow<'a> {
    pub(super) warp: &'a Warp<'a>,
    pub(super) plane: &'a PlaneProjection,
    pub(super) rows: &'a [RowMotion],
    /// Inverse depths of the first image.
    pub(super) known: &'a [f32],
    /// `(x/z, y/z)` of the pixels.
    pub(super) points: &'a [[f32; 2]],
    pub(super) y: usize,
    pub(super) out: &'a mut [f32],
}

/// A struct instead of a closure: only so is the body compiled for the processor at hand.
impl pulp::WithSimd for PlaneRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let pixels = self.known.chunks(LANES).zip(self.points.chunks(LANES));
        let mut row = self.y.min(self.rows.len() - 1);
        for (out, (known, points)) in self.out.chunks_mut(LANES).zip(pixels) {
            let (mut x, mut y, mut inverse) = ([0.0; LANES], [0.0; LANES], [f32::NAN; LANES]);
            inverse[..known.len()].copy_from_slice(known);
            for (k, point) in points.iter().enumerate() {
                [x[k], y[k]] = *point;
            }
            let chunk = Chunk {
                warp: self.warp,
                plane: self.plane,
                rows: self.rows,
                x,
                y,
            };
            for _ in 0..self.warp.steps {
                if self.rows.len() == 1 {
                    chunk.step::<false>(&mut inverse, &Exposure::default());
                } else {
                    let otherwise = Exposure {
                        row,
                        ..Exposure::default()
                    };
                    let exposure = chunk.exposure(&inverse, row).unwrap_or(otherwise);
                    chunk.step::<true>(&mut inverse, &exposure);
                    row = exposure.row;
                }
            }
            for (out, &inverse) in out.iter_mut().zip(&inverse) {
                *out = if inverse > 0.0 { inverse } else { f32::NAN };
            }
        }
    }
}

/// When neighbouring pixels are exposed, where the second image was read out row by row.
#[derive(Default)]
struct Exposure {
    /// The row whose motion is taken.
    row: usize,
    /// Rows between it and the one that sees the first pixel, and more of them from pixel to pixel.
    start: f32,
    slope: f32,
}

/// Neighbouring pixels of a row.
struct Chunk<'a> {
    warp: &'a Warp<'a>,
    plane: &'a PlaneProjection,
    rows: &'a [RowMotion],
    x: Lanes,
    y: Lanes,
}

impl Chunk<'_> {
    /// The rows of the second image that see these pixels, as far as `guess` says how the camera had
    /// moved by then; none where that is not known.
    #[inline(always)]
    fn exposure(&self, inverse: &Lanes, guess: usize) -> Option<Exposure> {
        let mut known = (0..LANES).filter(|&k| inverse[k] > 0.0);
        let first = known.next()?;
        let last = known.next_back().unwrap_or(first);
        let seen = |k: usize, row: usize| {
            let to = &self.rows[row].to;
            let at = to.turn([self.x[k], self.y[k], 1.0]);
            let [a, b, c] = [0, 1, 2].map(|i| at[i] + inverse[k] * to.translation[i]);
            self.plane.pixel(a / c, b / c).1
        };
        let v = seen(first, guess);
        // A pixel at v is exposed with row v, which moves it: v = v_guess + (v - guess) shift.
        let other = self.neighbour(guess);
        let shift = (seen(first, other) - v) / (other as f32 - guess as f32);
        let per_row = 1.0 / (1.0 - shift);
        let slope = (seen(last, guess) - v) / (last - first).max(1) as f32 * per_row;
        let start = guess as f32 + (v - guess as f32) * per_row - slope * first as f32;
        let middle = start + slope * (LANES / 2) as f32;
        if !middle.is_finite() {
            return None;
        }
        let row = (middle.round().max(0.0) as usize).min(self.rows.len() - 1);
        Some(Exposure {
            row,
            start: start - row as f32,
            slope,
        })
    }

    /// A row beside another.
    #[inline(always)]
    fn neighbour(&self, row: usize) -> usize {
        if row > 0 {
            row - 1
        } else {
            1.min(self.rows.len() - 1)
        }
    }

    /// One step of the fixed point: where the second image sees the surfaces that are `inverse` away,
    /// and how far they are according to it. `ROLLING`: the pixels' rows differ, and with them the
    /// motion, linearly.
    #[inline(always)]
    fn step<const ROLLING: bool>(&self, inverse: &mut Lanes, exposure: &Exposure) {
        let RowMotion { to, back } = &self.rows[exposure.row];
        let (mut to_change, mut back_change) = (Rigid::default(), Rigid::default());
        if ROLLING {
            let other = self.neighbour(exposure.row);
            let per_row = 1.0 / (other as f32 - exposure.row as f32);
            to_change = self.rows[other].to.minus(to, per_row);
            back_change = self.rows[other].back.minus(back, per_row);
        }
        let (mut a, mut b) = ([0.0; LANES], [0.0; LANES]);
        let (mut u, mut v) = ([0.0; LANES], [0.0; LANES]);
        // The points, times their inverse depth: no division.
        for k in 0..LANES {
            let (x, y, inverse) = (self.x[k], self.y[k], inverse[k]);
            let rows = exposure.start + exposure.slope * k as f32;
            let along = |i: usize| {
                let (r, t) = (&to.rotation[i], to.translation[i]);
                let still = r[0] * x + r[1] * y + r[2] + inverse * t;
                if !ROLLING {
                    return still;
                }
                let (r, t) = (&to_change.rotation[i], to_change.translation[i]);
                still + rows * (r[0] * x + r[1] * y + r[2] + inverse * t)
            };
            let c = along(2);
            let per_c = if c > 0.0 { 1.0 / c } else { f32::NAN };
            (a[k], b[k]) = (along(0) * per_c, along(1) * per_c);
            (u[k], v[k]) = self.plane.pixel(a[k], b[k]);
        }
        let seen = self.bilinear(&u, &v);
        for k in 0..LANES {
            let (a, b, seen) = (a[k], b[k], seen[k]);
            let (r, t) = (&back.rotation[2], back.translation[2]);
            let mut along = r[0] * a + r[1] * b + r[2] + seen * t;
            if ROLLING {
                let rows = exposure.start + exposure.slope * k as f32;
                let (r, t) = (&back_change.rotation[2], back_change.translation[2]);
                along += rows * (r[0] * a + r[1] * b + r[2] + seen * t);
            }
            inverse[k] = seen / along;
        }
    }

    /// Bilinear values of the second image; NaN outside, next to a hole or across a jump.
    #[inline(always)]
    fn bilinear(&self, u: &Lanes, v: &Lanes) -> Lanes {
        let (width, height) = (self.warp.table.width, self.warp.table.height);
        let (right, bottom) = ((width - 1) as f32, (height - 1) as f32);
        let (mut column, mut line) = ([0_i32; LANES], [0_i32; LANES]);
        let mut outside = [0.0; LANES];
        for k in 0..LANES {
            // false for NaN
            let inside = (u[k] >= 0.0) & (v[k] >= 0.0) & (u[k] < right) & (v[k] < bottom);
            outside[k] = if inside { 0.0 } else { f32::NAN };
            column[k] = if inside { u[k] as i32 } else { 0 };
            line[k] = if inside { v[k] as i32 } else { 0 };
        }
        let values = &self.warp.second.values;
        let mut corners = [[f32::NAN; LANES]; 4];
        for k in 0..LANES {
            let i = line[k] as usize * width + column[k] as usize;
            if let Some(four) = values.get(i..i + width + 2) {
                corners[0][k] = four[0];
                corners[1][k] = four[1];
                corners[2][k] = four[width];
                corners[3][k] = four[width + 1];
            }
        }
        let mut out = [0.0; LANES];
        let [a, b, c, d] = &corners;
        for k in 0..LANES {
            let (u, v) = (u[k] - column[k] as f32, v[k] - line[k] as f32);
            let (a, b, c, d) = (a[k], b[k], c[k], d[k]);
            let (top, bottom) = (a + (b - a) * u, c + (d - c) * u);
            let value = top + (bottom - top) * v + outside[k];
            let spread =
                largest(largest(a, b), largest(c, d)) - smallest(smallest(a, b), smallest(c, d));
            // A NaN among the four makes `value` NaN and fails the comparison.
            out[k] = if spread <= self.warp.max_jump * value {
                value
            } else {
                f32::NAN
            };
        }
        out
    }
}

/// As the processor does it; what becomes of NaN does not matter here.
#[inline(always)]
fn smallest(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn largest(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use crate::binning::InverseDepth;
    use crate::depth_image::Axis;
    use crate::plane_projection::PlaneProjection;
    use crate::sphere_table::SphereTable;
    use crate::warp::Warp;
    use nalgebra::{Vector2, Vector3, Vector6};
    use sphereflow_core::{Pose, Twist};
    use sphereflow_sphere::Camera;
    use sphereflow_sphere::RollingShutter;
    use sphereflow_sphere::lie::se3;

    const WIDTH: usize = 161; // not a multiple of the lanes
    const HEIGHT: usize = 120;

    /// Inverse depth of a slanted wall, each row from its own pose in the first camera's frame.
    fn wall(camera: &Camera, pose_of_row: impl Fn(usize) -> Pose) -> InverseDepth {
        let normal = Vector3::new(0.3, -0.2, 0.9);
        let values = (0..WIDTH * HEIGHT).map(|i| {
            let (x, y) = (i % WIDTH, i / WIDTH);
            let pose = pose_of_row(y);
            let ray = camera.unproject(&Vector2::new(x as f64, y as f64)).unwrap();
            let along = normal.dot(&(pose.rotation * (ray / ray.z)));
            (along / (2.0 - normal.dot(&pose.translation))) as f32
        });
        InverseDepth {
            values: values.collect(),
            axis: Axis::Optical,
        }
    }

    /// Largest and rms relative error of a wall seen through a rolling shutter, where it is seen.
    fn errors(plane: bool, roll: f64, turn: f64) -> (f32, f32) {
        let camera = Camera::pinhole(145.0, 145.0, 80.0, 59.5, WIDTH, HEIGHT).unwrap();
        let table = SphereTable::new(&camera, 1).unwrap();
        let motion = se3::exp(&Vector6::new(0.02, -0.03, roll, 0.03, 0.02, -0.04));
        let twist = Twist::from_vector(&Vector6::new(turn, -0.5 * turn, 0.7 * turn, 0.3, 0.2, 0.1));
        let shutter = RollingShutter {
            twist,
            readout_s: 0.03,
        };
        let first = wall(&camera, |_| Pose::identity());
        let second = wall(&camera, |y| {
            let s = ((y as f64 + 0.5) / HEIGHT as f64 - 0.5) * shutter.readout_s;
            motion * se3::exp(&(twist.vector() * s))
        });
        let projection = PlaneProjection::new(&camera);
        let mut warped = InverseDepth::default();
        Warp {
            camera: &camera,
            plane: projection.as_ref().filter(|_| plane),
            table: &table,
            second: &second,
            motion,
            shutter,
            max_jump: 0.12,
            steps: 3,
        }
        .fill(&first, &mut Vec::new(), &mut warped);
        let pairs = warped.values.iter().zip(&first.values);
        let off: Vec<f32> = pairs
            .filter(|(w, _)| w.is_finite())
            .map(|(w, f)| (w / f - 1.0).abs())
            .collect();
        assert!(off.len() > WIDTH * HEIGHT / 2);
        let square = off.iter().map(|e| e * e).sum::<f32>() / off.len() as f32;
        (off.iter().copied().fold(0.0, f32::max), square.sqrt())
    }

    #[test]
    fn warp_of_rows_exposed_one_after_the_other_gives_the_first_image() {
        /// Relative: rounding, and the motion's change from row to row taken as linear.
        const MOST: f32 = 3e-5;
        const RMS: f32 = 5e-6;
        /// Pixel by pixel, with the motion of the nearest row: what it turns within a row.
        const ROW: f32 = 1e-3;
        for (roll, turn) in [(0.0, 0.0), (0.0, 1.0), (0.3, 1.0), (-0.3, 3.0)] {
            let ((most, rms), each) = (errors(true, roll, turn), errors(false, roll, turn));
            println!(
                "roll {roll}, {turn} rad/s: {most:.1e}, rms {rms:.1e}; by nearest row {each:?}"
            );
            assert!(most < MOST && rms < RMS, "{most} {rms}");
            assert!(each.0 < ROW, "{each:?}");
        }
    }
}
