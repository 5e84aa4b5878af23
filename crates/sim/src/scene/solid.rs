//! Solid furniture: boxes, balls and upright cylinders, seen from outside.

use super::SurfacePoint;
use super::shape::{face_normal, face_uv};
use nalgebra::Vector3;

/// A solid box turned about the vertical; invisible from inside. Faces as those of a room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    pub(super) centre: Vector3<f64>,
    pub(super) half_size_m: Vector3<f64>,
    sin: f64,
    cos: f64,
}

impl Block {
    /// From its centre, half of its width (x), height (y) and length (z), metres, and its turn
    /// about the y axis, radians, positive from z towards x.
    pub fn new(centre: Vector3<f64>, half_size_m: Vector3<f64>, yaw_rad: f64) -> Self {
        let (sin, cos) = yaw_rad.sin_cos();
        Self {
            centre,
            half_size_m,
            sin,
            cos,
        }
    }

    pub(super) fn contains(&self, point: &Vector3<f64>) -> bool {
        let local = self.local(&(point - self.centre));
        (0..3).all(|axis| local[axis].abs() <= self.half_size_m[axis])
    }

    /// See [`super::Shape::least_along`].
    #[inline]
    pub(super) fn least_along(&self, normal: &Vector3<f64>) -> f64 {
        normal.dot(&self.centre) - self.local(normal).abs().dot(&self.half_size_m)
    }

    /// World direction into the frame of the box.
    #[inline]
    fn local(&self, v: &Vector3<f64>) -> Vector3<f64> {
        let (sin, cos) = (self.sin, self.cos);
        Vector3::new(cos * v.x - sin * v.z, v.y, sin * v.x + cos * v.z)
    }

    #[inline]
    pub(super) fn cross(&self, origin: &Vector3<f64>, unit: &Vector3<f64>) -> Option<(f64, usize)> {
        let o = self.local(&(origin - self.centre));
        let d = self.local(unit);
        let (mut enter, mut leave, mut face) = (f64::NEG_INFINITY, f64::INFINITY, 0);
        for axis in 0..3 {
            let (inverse, half) = (1.0 / d[axis], self.half_size_m[axis]);
            let (lo, hi) = ((-half - o[axis]) * inverse, (half - o[axis]) * inverse);
            let (near, far) = if inverse > 0.0 { (lo, hi) } else { (hi, lo) };
            if near > enter {
                (enter, face) = (near, 2 * axis + usize::from(inverse < 0.0));
            }
            leave = leave.min(far);
        }
        (enter > 0.0 && enter <= leave).then_some((enter, face))
    }

    #[inline]
    pub(super) fn surface(
        &self,
        point: &Vector3<f64>,
        face: usize,
        _: &Vector3<f64>,
    ) -> SurfacePoint {
        let local = self.local(&(point - self.centre));
        let (n, sin, cos) = (face_normal(face), self.sin, self.cos);
        SurfacePoint {
            normal: Vector3::new(cos * n.x + sin * n.z, n.y, cos * n.z - sin * n.x),
            uv: face_uv(&local, face),
            local,
        }
    }
}

/// A solid sphere; invisible from inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Centre, metres.
    pub centre: Vector3<f64>,
    /// Radius, metres.
    pub radius_m: f64,
}

impl Ball {
    #[inline]
    pub(super) fn cross(&self, origin: &Vector3<f64>, unit: &Vector3<f64>) -> Option<(f64, usize)> {
        let o = origin - self.centre;
        let ahead = -o.dot(unit);
        // Distance of the line from the centre first: exact where the squares would cancel.
        let miss = (o + unit * ahead).norm_squared();
        let half_chord = (self.radius_m * self.radius_m - miss).max(0.0).sqrt();
        let range_m = ahead - half_chord;
        (half_chord > 0.0 && range_m > 0.0).then_some((range_m, 0))
    }

    #[inline]
    pub(super) fn surface(&self, point: &Vector3<f64>, _: usize, _: &Vector3<f64>) -> SurfacePoint {
        let local = point - self.centre;
        SurfacePoint {
            normal: local / self.radius_m,
            uv: [local.x, local.y],
            local,
        }
    }
}

/// A solid upright cylinder with caps; invisible from inside. Faces: 0 the side, 1 the top, 2 the
/// bottom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Middle of the axis, metres.
    pub centre: Vector3<f64>,
    /// Radius, metres.
    pub radius_m: f64,
    /// Half of its height, metres.
    pub half_height_m: f64,
}

impl Cylinder {
    pub(super) fn contains(&self, point: &Vector3<f64>) -> bool {
        let local = point - self.centre;
        local.x.hypot(local.z) <= self.radius_m && local.y.abs() <= self.half_height_m
    }

    #[inline]
    pub(super) fn cross(&self, origin: &Vector3<f64>, unit: &Vector3<f64>) -> Option<(f64, usize)> {
        let o = origin - self.centre;
        let (a, r2) = (
            unit.x * unit.x + unit.z * unit.z,
            self.radius_m * self.radius_m,
        );
        let outside = o.x * o.x + o.z * o.z > r2;
        if outside && a > 0.0 {
            let ahead = -(o.x * unit.x + o.z * unit.z) / a;
            let (x, z) = (o.x + unit.x * ahead, o.z + unit.z * ahead);
            let half_chord = ((r2 - x * x - z * z) / a).max(0.0).sqrt();
            let range_m = ahead - half_chord;
            let height = o.y + unit.y * range_m;
            if half_chord <= 0.0 || ahead < 0.0 {
                return None;
            }
            if height.abs() <= self.half_height_m {
                return Some((range_m, 0));
            }
        }
        // The cap on the side of the origin: top is -y.
        let from_above = o.y < -self.half_height_m;
        if !from_above && o.y <= self.half_height_m {
            return None;
        }
        let cap = if from_above {
            -self.half_height_m
        } else {
            self.half_height_m
        };
        let range_m = (cap - o.y) / unit.y;
        let (x, z) = (o.x + unit.x * range_m, o.z + unit.z * range_m);
        (range_m > 0.0 && x * x + z * z <= r2).then_some((range_m, if from_above { 1 } else { 2 }))
    }

    #[inline]
    pub(super) fn surface(
        &self,
        point: &Vector3<f64>,
        face: usize,
        _: &Vector3<f64>,
    ) -> SurfacePoint {
        let local = point - self.centre;
        let (normal, uv) = match face {
            0 => (
                Vector3::new(local.x, 0.0, local.z) / self.radius_m,
                [self.radius_m * local.x.atan2(local.z), local.y],
            ),
            1 => (-Vector3::y(), [local.x, local.z]),
            _ => (Vector3::y(), [local.x, local.z]),
        };
        SurfacePoint { normal, uv, local }
    }
}
