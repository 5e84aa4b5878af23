//! The second image as the first would show it, each row of both exposed at its own time.

use super::image_model::ImageModel;
use nalgebra::{Matrix3, Vector3, Vector6};
use sphereflow_alignment::Axis;
use sphereflow_alignment::binning::InverseDepth;
use sphereflow_core::Pose;
use sphereflow_sphere::lie::se3;

/// Rounds of finding the row that sees a point at its own time: each leaves a few percent of the
/// error of the one before, at a radian a second.
const ROW_ROUNDS: usize = 2;

/// Looks up the second image from where and when the first image's rows were taken.
pub(super) struct RowWarp<'a> {
    pub(super) model: &'a ImageModel,
    pub(super) second: &'a InverseDepth,
    /// `first_from_second` between the stamps.
    pub(super) motion: Pose,
    /// Velocities `[omega, v]` of both frames at their stamps.
    pub(super) velocities: [Vector6<f64>; 2],
    /// Largest spread of the four values of an interpolation, as a share of their mean.
    pub(super) max_jump: f32,
}

impl RowWarp<'_> {
    /// Fills `out` with the inverse depths of the second image on the rays of the first; NaN where
    /// `first` is unknown or the second does not show the ray's surface.
    pub(super) fn fill(&self, first: &InverseDepth, out: &mut InverseDepth) {
        let table = &self.model.table;
        let rays = table.rays(Axis::Optical);
        out.axis = Axis::Optical;
        out.values.resize(first.values.len(), f32::NAN);
        for (y, row) in out.values.chunks_mut(table.width).enumerate() {
            let time_s = self.model.row_time_s(y as f64);
            // second at its stamp, from first when this row was exposed
            let motion = self.motion.inverse() * se3::exp(&(self.velocities[0] * time_s));
            let rotation = *motion.rotation.to_rotation_matrix().matrix();
            for (x, value) in row.iter_mut().enumerate() {
                let i = y * table.width + x;
                let range = f64::from(rays.length[i] / first.values[i]);
                let ray = Vector3::from(rays.direction[i].map(f64::from));
                let seen = self.range(&ray, range, (&rotation, &motion.translation), time_s);
                *value = seen.map_or(f32::NAN, |range| rays.length[i] / range as f32);
            }
        }
    }

    /// Range of the second image's surface along a ray of the first whose own range is given.
    fn range(
        &self,
        ray: &Vector3<f64>,
        own_m: f64,
        (rotation, translation): (&Matrix3<f64>, &Vector3<f64>),
        time_s: f64,
    ) -> Option<f64> {
        if !own_m.is_finite() {
            return None;
        }
        let at_stamp = rotation * (ray * own_m) + translation;
        let mut second_s = time_s;
        let mut pixel = None;
        let mut towards = at_stamp;
        for _ in 0..ROW_ROUNDS {
            towards = moved(&at_stamp, &self.velocities[1], -second_s);
            let found = self.model.binned.project(&towards)?;
            second_s = self.model.row_time_s(found.y);
            pixel = Some(found);
        }
        let pixel = pixel?;
        let inverse = self.sample(pixel.x, pixel.y)?;
        let surface = towards / (towards.z * inverse);
        let surface = moved(&surface, &self.velocities[1], second_s);
        let range = ray.dot(&rotation.tr_mul(&(surface - translation)));
        (range > 0.0).then_some(range)
    }

    /// 1/Z of the second image between four blocks: exact on planes, to the bend of the lens over
    /// one block.
    fn sample(&self, x: f64, y: f64) -> Option<f64> {
        let (width, height) = (self.model.table.width, self.model.table.height);
        let (left, top) = (x.floor(), y.floor());
        let inside = left >= 0.0 && top >= 0.0 && left + 1.0 < width as f64;
        if !(inside && top + 1.0 < height as f64) {
            return None;
        }
        let (u, v) = ((x - left) as f32, (y - top) as f32);
        let i = top as usize * width + left as usize;
        let upper = self.second.values.get(i..i + 2)?;
        let lower = self.second.values.get(i + width..i + width + 2)?;
        let ([a, b], [c, d]) = ([upper[0], upper[1]], [lower[0], lower[1]]);
        let value = (a * (1.0 - u) + b * u) * (1.0 - v) + (c * (1.0 - u) + d * u) * v;
        let spread = a.max(b).max(c).max(d) - a.min(b).min(c).min(d);
        // A NaN among the four makes `value` NaN and fails the comparison.
        (spread <= self.max_jump * value).then_some(f64::from(value))
    }
}

/// Where a point of the camera frame is in that of `time_s` earlier: `exp([omega, v] t) X` to
/// second order, which leaves 1e-5 rad at 3 rad/s and 15 ms.
fn moved(point: &Vector3<f64>, velocity: &Vector6<f64>, time_s: f64) -> Vector3<f64> {
    let omega = velocity.fixed_rows::<3>(0).into_owned();
    let linear = velocity.fixed_rows::<3>(3).into_owned();
    let rate = linear + omega.cross(point);
    point + rate * time_s + omega.cross(&rate) * (0.5 * time_s * time_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moved_point_follows_the_exponential() {
        let velocity = Vector6::new(1.0, -2.0, 0.5, 0.3, 0.2, -0.4);
        let point = Vector3::new(0.4, -0.3, 2.0);
        for time_s in [-0.015, 0.01] {
            let expected = se3::exp(&(velocity * time_s)).transform(&point);
            // third order: (2.3 * 0.015)^3 / 6 of two metres
            assert!((moved(&point, &velocity, time_s) - expected).norm() < 2e-5);
        }
    }
}
