//! The second image as the camera would see it from where the first was taken.

use crate::binning::InverseDepth;
use crate::depth_image::Axis;
use crate::sphere_table::SphereTable;
use crate::weak_form::factor;
use nalgebra::{Vector2, Vector3};
use rayon::prelude::*;
use sphereflow_core::Pose;
use sphereflow_sphere::Camera;

/// Each step divides the error by the share that the motion changes the range by.
const FIXED_POINT_STEPS: usize = 2;

/// Looks up a second image from the pose of the first.
pub(crate) struct Warp<'a> {
    pub(crate) camera: &'a Camera,
    pub(crate) table: &'a SphereTable,
    pub(crate) second: &'a InverseDepth,
    /// `first_from_second`.
    pub(crate) motion: Pose,
    /// Largest spread of the four values of an interpolation, as a share of their mean.
    pub(crate) max_jump: f32,
}

impl Warp<'_> {
    /// Fills `out` with the inverse depths of the second image on the rays of the first. Where
    /// `first` is unknown, or the second image does not show the ray's surface, it is NaN.
    pub(crate) fn fill(&self, first: &InverseDepth, out: &mut InverseDepth) {
        let width = self.table.width;
        out.axis = first.axis;
        out.values.resize(first.values.len(), f32::NAN);
        out.values
            .par_chunks_mut(width)
            .with_min_len(16)
            .enumerate()
            .for_each(|(y, row)| {
                for (x, value) in row.iter_mut().enumerate() {
                    let i = y * width + x;
                    let ray = &self.table.ray[i];
                    let to_range = factor(first.axis, ray);
                    let range = 1.0 / f64::from(first.values[i] * to_range);
                    *value = match self.range_along(ray, range) {
                        Some(range) => (1.0 / range) as f32 / to_range,
                        None => f32::NAN,
                    };
                }
            });
    }

    /// Range of the second image's surface along a ray of the first, beginning at a guess.
    fn range_along(&self, ray: &[f32; 3], guess_m: f64) -> Option<f64> {
        if !guess_m.is_finite() {
            return None;
        }
        let ray = Vector3::from(ray.map(f64::from));
        let back = self.motion.inverse();
        let mut range = guess_m;
        for _ in 0..FIXED_POINT_STEPS {
            let point = back.transform(&(ray * range));
            let towards = point / point.norm();
            let seen = self.sample(&self.camera.project(&point)?, towards.z)?;
            range = ray.dot(&self.motion.transform(&(towards / seen)));
        }
        (range > 0.0).then_some(range)
    }

    /// Inverse range at `pixel`, bilinear in the inverse depth: exact on planes.
    fn sample(&self, pixel: &Vector2<f64>, ray_z: f64) -> Option<f64> {
        let (width, height) = (self.table.width as isize, self.table.height as isize);
        let (x0, y0) = (pixel.x.floor(), pixel.y.floor());
        let (u, v) = ((pixel.x - x0) as f32, (pixel.y - y0) as f32);
        let (x0, y0) = (x0 as isize, y0 as isize);
        let column = |x: isize| {
            if self.table.wraps {
                x.rem_euclid(width)
            } else {
                x
            }
        };
        let (x0, x1) = (column(x0), column(x0.saturating_add(1)));
        let inside = |x: isize| (0..width).contains(&x);
        if !inside(x0) || !inside(x1) || y0 < 0 || y0.saturating_add(1) >= height {
            return None;
        }
        let at = |x: isize, y: isize| self.second.values[(y * width + x) as usize];
        let (a, b, c, d) = (at(x0, y0), at(x1, y0), at(x0, y0 + 1), at(x1, y0 + 1));
        let value = (a * (1.0 - u) + b * u) * (1.0 - v) + (c * (1.0 - u) + d * u) * v;
        let spread = a.max(b).max(c).max(d) - a.min(b).min(c).min(d);
        let along = match self.second.axis {
            Axis::Optical => ray_z,
            Axis::Ray => 1.0,
        };
        let inverse_range = f64::from(value) * along;
        // A NaN among the four makes `value` NaN and fails the comparison.
        (spread <= self.max_jump * value && inverse_range > 0.0).then_some(inverse_range)
    }
}
