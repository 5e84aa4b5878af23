//! The inside of an ellipsoid: closed, convex and smooth, the scene of hypothesis H1.

use super::SurfacePoint;
use nalgebra::Vector3;

/// The inside of an ellipsoid with axes along the world's; invisible from outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    /// Centre, metres.
    pub centre: Vector3<f64>,
    /// Half lengths along x, y, z, metres.
    pub semi_axes_m: Vector3<f64>,
}

impl Ellipsoid {
    pub(super) fn contains(&self, point: &Vector3<f64>) -> bool {
        let offset = (point - self.centre).component_div(&self.semi_axes_m);
        offset.norm_squared() < 1.0
    }

    #[inline]
    pub(super) fn cross(&self, origin: &Vector3<f64>, unit: &Vector3<f64>) -> Option<(f64, usize)> {
        let o = (origin - self.centre).component_div(&self.semi_axes_m);
        let d = unit.component_div(&self.semi_axes_m);
        // a t^2 + 2 b t + c = 0, c < 0 inside: one root of each sign, the positive one written
        // without the difference of nearly equal numbers.
        let (a, b, c) = (d.norm_squared(), o.dot(&d), o.norm_squared() - 1.0);
        if c >= 0.0 {
            return None;
        }
        let root = (b * b - a * c).sqrt();
        let range_m = if b > 0.0 {
            -c / (b + root)
        } else {
            (root - b) / a
        };
        Some((range_m, 0))
    }

    #[inline]
    pub(super) fn surface(&self, point: &Vector3<f64>, _: usize, _: &Vector3<f64>) -> SurfacePoint {
        let local = point - self.centre;
        let gradient = local
            .component_div(&self.semi_axes_m)
            .component_div(&self.semi_axes_m);
        SurfacePoint {
            normal: -gradient.normalize(),
            uv: [local.x, local.y],
            local,
        }
    }
}
