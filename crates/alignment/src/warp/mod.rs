//! The second image as the camera would see it from where the first was taken.

mod plane;

use crate::binning::InverseDepth;
use crate::depth_image::Axis;
use crate::plane_projection::PlaneProjection;
use crate::row_motion::{self, RowMotion};
use crate::sphere_table::SphereTable;
use nalgebra::{Matrix3, Vector2, Vector3};
use plane::PlaneRow;
use rayon::prelude::*;
use sphereflow_core::Pose;
use sphereflow_sphere::{Camera, RollingShutter};

/// Rows that a thread takes at once.
const ROWS: usize = 16;

/// Looks up a second image from the pose of the first.
pub struct Warp<'a> {
    /// Camera of the averaged image.
    pub camera: &'a Camera,
    /// The same in single precision, where there is one.
    pub plane: Option<&'a PlaneProjection>,
    /// Rays of the first image's blocks.
    pub table: &'a SphereTable,
    /// The image that is looked up.
    pub second: &'a InverseDepth,
    /// `first_from_second`, at the second's stamp.
    pub motion: Pose,
    /// How the second image was read out.
    pub shutter: RollingShutter,
    /// Largest spread of the four values of an interpolation, as a share of their mean.
    pub max_jump: f32,
    /// The first image's own range is the guess. Each step leaves an error of one order more in
    /// what is still wrong with the motion.
    pub steps: usize,
}

impl Warp<'_> {
    /// Fills `out` with the inverse depths of the second image on the rays of the first. Where
    /// `first` is unknown, or the second image does not show the ray's surface, it is NaN. `rows`
    /// is working memory.
    pub fn fill(&self, first: &InverseDepth, rows: &mut Vec<RowMotion>, out: &mut InverseDepth) {
        let width = self.table.width;
        row_motion::fill(rows, &self.motion, &self.shutter, self.table.height);
        out.axis = first.axis;
        out.values.resize(first.values.len(), f32::NAN);
        let both_along_axis = (first.axis, self.second.axis) == (Axis::Optical, Axis::Optical);
        let plane = self.plane.filter(|_| both_along_axis);
        let lines = out.values.par_chunks_mut(width).with_min_len(ROWS);
        let arch = pulp::Arch::new();
        lines.enumerate().for_each(|(y, line)| match plane {
            Some(plane) => {
                let pixels = y * width..y * width + line.len();
                arch.dispatch(PlaneRow {
                    warp: self,
                    plane,
                    rows,
                    known: &first.values[pixels.clone()],
                    points: &self.table.plane[pixels],
                    y,
                    out: line,
                });
            }
            None => self.fill_on_sphere(rows, first, y, line),
        });
    }

    /// One row, for every camera and either kind of distance.
    fn fill_on_sphere(&self, rows: &[RowMotion], first: &InverseDepth, y: usize, line: &mut [f32]) {
        let width = line.len();
        let rays = self.table.rays(first.axis);
        let last_row = rows.len() - 1;
        let mut row = y.min(last_row);
        for (x, value) in line.iter_mut().enumerate() {
            let i = y * width + x;
            let guess = f64::from(rays.length[i] / first.values[i]);
            let ray = Vector3::from(rays.direction[i].map(f64::from));
            *value = match self.range_along(&ray, guess, rows, &mut row) {
                Some(range) => rays.length[i] / range as f32,
                None => f32::NAN,
            };
        }
    }

    /// Range of the second image's surface along a ray of the first, beginning at a guess.
    fn range_along(
        &self,
        ray: &Vector3<f64>,
        guess_m: f64,
        rows: &[RowMotion],
        row: &mut usize,
    ) -> Option<f64> {
        if !guess_m.is_finite() {
            return None;
        }
        let mut range = guess_m;
        for _ in 0..self.steps {
            let (rotation, translation) = double(&rows[*row].back);
            let point = rotation.tr_mul(&(ray * range - translation));
            let towards = point / point.norm();
            let pixel = self.camera.project(&point)?;
            *row = (pixel.y.max(0.0).round() as usize).min(rows.len() - 1);
            let inverse = self.sample(&pixel, &towards)?;
            let (rotation, translation) = double(&rows[*row].back);
            range = ray.dot(&(rotation * (towards / inverse) + translation));
        }
        (range > 0.0).then_some(range)
    }

    /// Inverse range of the second image along `towards`, which `pixel` sees: bilinear in the
    /// values and in their vectors, which is exact on planes.
    fn sample(&self, pixel: &Vector2<f64>, towards: &Vector3<f64>) -> Option<f64> {
        let corners = self.corners(pixel)?;
        let values = corners.map(|i| self.second.values[i]);
        let high = values.iter().copied().fold(values[0], f32::max);
        let low = values.iter().copied().fold(values[0], f32::min);
        let (u, v) = (pixel.x - pixel.x.floor(), pixel.y - pixel.y.floor());
        let rays = self.table.rays(self.second.axis);
        let vectors = corners
            .map(|i| Vector3::from(rays.direction[i].map(f64::from)) * f64::from(rays.length[i]));
        let (du, dv) = step_towards(&vectors, (u, v), towards);
        let (u, v) = (u + du, v + dv);
        let value = bilinear(values.map(f64::from), u, v);
        let along = bilinear(vectors.map(|p| p.dot(towards)), u, v);
        // A NaN among the four makes `value` NaN and fails the comparison.
        (f64::from(high - low) <= f64::from(self.max_jump) * value).then(|| value / along)
    }

    /// Indices of the blocks around a pixel: upper left, upper right, lower left, lower right.
    fn corners(&self, pixel: &Vector2<f64>) -> Option<[usize; 4]> {
        let (width, height) = (self.table.width as isize, self.table.height as isize);
        let (x, y) = (pixel.x.floor() as isize, pixel.y.floor() as isize);
        let column = |x: isize| {
            if self.table.wraps {
                x.rem_euclid(width)
            } else {
                x
            }
        };
        let (x0, x1) = (column(x), column(x.saturating_add(1)));
        let inside = |x: isize| (0..width).contains(&x);
        if !inside(x0) || !inside(x1) || y < 0 || y.saturating_add(1) >= height {
            return None;
        }
        let at = |x: isize, y: isize| (y * width + x) as usize;
        Some([at(x0, y), at(x1, y), at(x0, y + 1), at(x1, y + 1)])
    }
}

fn double(rigid: &row_motion::Rigid) -> (Matrix3<f64>, Vector3<f64>) {
    let r = rigid.rotation;
    (
        Matrix3::from_fn(|i, j| f64::from(r[i][j])),
        Vector3::from(rigid.translation.map(f64::from)),
    )
}

fn bilinear(corners: [f64; 4], u: f64, v: f64) -> f64 {
    let [a, b, c, d] = corners;
    (a * (1.0 - u) + b * u) * (1.0 - v) + (c * (1.0 - u) + d * u) * v
}

/// What to add to `(u, v)` for the vectors' interpolation to point `towards`: zero where they are
/// linear in the pixel, as those of a pinhole. One step of Gauss and Newton.
fn step_towards(
    [a, b, c, d]: &[Vector3<f64>; 4],
    (u, v): (f64, f64),
    towards: &Vector3<f64>,
) -> (f64, f64) {
    let across = |p: Vector3<f64>| p - towards * p.dot(towards);
    let by_u = across((b - a) * (1.0 - v) + (d - c) * v);
    let by_v = across((c - a) * (1.0 - u) + (d - b) * u);
    let miss = across((a * (1.0 - u) + b * u) * (1.0 - v) + (c * (1.0 - u) + d * u) * v);
    let (uu, uv, vv) = (by_u.dot(&by_u), by_u.dot(&by_v), by_v.dot(&by_v));
    let (ru, rv) = (by_u.dot(&miss), by_v.dot(&miss));
    let determinant = uu * vv - uv * uv;
    if determinant <= 0.0 {
        return (0.0, 0.0); // at a pole, where a step sideways is none
    }
    (
        (uv * rv - vv * ru) / determinant,
        (uv * ru - uu * rv) / determinant,
    )
}
