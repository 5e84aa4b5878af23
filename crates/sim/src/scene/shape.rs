//! The shapes behind one interface, and the flat ones seen from inside or from both sides.

use super::{Ball, Block, Crossing, Cylinder, Ellipsoid, SurfacePoint};
use nalgebra::Vector3;

/// A surface that rays can meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// The inside of an axis-aligned box.
    Room(Room),
    /// The inside of an ellipsoid or sphere.
    Ellipsoid(Ellipsoid),
    /// A solid box, turned about the vertical.
    Block(Block),
    /// A solid sphere.
    Ball(Ball),
    /// A solid upright cylinder with caps.
    Cylinder(Cylinder),
    /// A flat rectangle with two sides.
    Rectangle(Rectangle),
}

/// Calls a method on whichever shape is there.
macro_rules! on_shape {
    ($shape:expr, $s:ident => $call:expr) => {
        match $shape {
            Shape::Room($s) => $call,
            Shape::Ellipsoid($s) => $call,
            Shape::Block($s) => $call,
            Shape::Ball($s) => $call,
            Shape::Cylinder($s) => $call,
            Shape::Rectangle($s) => $call,
        }
    };
}

macro_rules! shape_from {
    ($($kind:ident),*) => {$(
        impl From<$kind> for Shape {
            fn from(shape: $kind) -> Self {
                Self::$kind(shape)
            }
        }
    )*};
}
shape_from!(Room, Ellipsoid, Block, Ball, Cylinder, Rectangle);

impl Shape {
    /// The nearer of `so_far` and the crossing of this shape, if any.
    #[inline]
    pub(crate) fn nearer(
        &self,
        origin: &Vector3<f64>,
        unit: &Vector3<f64>,
        primitive: usize,
        so_far: Option<Crossing>,
    ) -> Option<Crossing> {
        match on_shape!(self, s => s.cross(origin, unit)) {
            Some((range_m, face)) if so_far.is_none_or(|c| range_m < c.range_m) => Some(Crossing {
                range_m,
                primitive,
                face,
            }),
            _ => so_far,
        }
    }

    /// Normal and coordinates at a point of the surface.
    #[inline]
    pub(crate) fn surface(
        &self,
        point: &Vector3<f64>,
        face: usize,
        unit: &Vector3<f64>,
    ) -> SurfacePoint {
        on_shape!(self, s => s.surface(point, face, unit))
    }

    /// Centre and radius of a ball around it; `None` for what surrounds the camera.
    pub(crate) fn bounding_ball(&self) -> Option<(Vector3<f64>, f64)> {
        match self {
            Self::Room(_) | Self::Ellipsoid(_) => None,
            Self::Block(s) => Some((s.centre, s.half_size_m.norm())),
            Self::Ball(s) => Some((s.centre, s.radius_m)),
            Self::Cylinder(s) => Some((s.centre, s.radius_m.hypot(s.half_height_m))),
            Self::Rectangle(s) => Some((s.centre, s.half_u.norm().hypot(s.half_v.norm()))),
        }
    }

    /// The size that is not a positive number, if any, and its value in words.
    pub(crate) fn check(&self) -> Result<(), (&'static str, String)> {
        let positive = |name: &'static str, sizes: &[f64]| {
            let fine = sizes.iter().all(|s| s.is_finite() && *s > 0.0);
            if fine {
                Ok(())
            } else {
                Err((name, format!("{sizes:?}")))
            }
        };
        match self {
            Self::Room(s) => positive("max - min", (s.max - s.min).as_slice()),
            Self::Ellipsoid(s) => positive("semi_axes_m", s.semi_axes_m.as_slice()),
            Self::Block(s) => positive("half_size_m", s.half_size_m.as_slice()),
            Self::Ball(s) => positive("radius_m", &[s.radius_m]),
            Self::Cylinder(s) => {
                positive("radius_m, half_height_m", &[s.radius_m, s.half_height_m])
            }
            Self::Rectangle(s) => positive("half_u, half_v", &[s.half_u.norm(), s.half_v.norm()]),
        }
    }
}

/// The inside of an axis-aligned box; invisible from outside. Faces: -x, +x, -y (ceiling), +y
/// (floor), -z, +z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Room {
    /// Corner of the smallest coordinates, metres.
    pub min: Vector3<f64>,
    /// Corner of the largest coordinates, metres.
    pub max: Vector3<f64>,
}

impl Room {
    #[inline]
    fn cross(&self, origin: &Vector3<f64>, unit: &Vector3<f64>) -> Option<(f64, usize)> {
        let (mut range_m, mut face) = (f64::INFINITY, 0);
        for axis in 0..3 {
            let o = origin[axis];
            if !(o > self.min[axis] && o < self.max[axis]) {
                return None;
            }
            let ahead = unit[axis] > 0.0;
            let wall = if ahead {
                self.max[axis]
            } else {
                self.min[axis]
            };
            let t = (wall - o) / unit[axis];
            if t > 0.0 && t < range_m {
                (range_m, face) = (t, 2 * axis + usize::from(ahead));
            }
        }
        range_m.is_finite().then_some((range_m, face))
    }

    #[inline]
    fn surface(&self, point: &Vector3<f64>, face: usize, _: &Vector3<f64>) -> SurfacePoint {
        SurfacePoint {
            normal: -face_normal(face),
            uv: face_uv(point, face),
            local: *point,
        }
    }
}

/// Outward normal of a box's face.
#[inline]
pub(super) fn face_normal(face: usize) -> Vector3<f64> {
    let mut normal = Vector3::zeros();
    normal[face / 2 % 3] = if face.is_multiple_of(2) { -1.0 } else { 1.0 };
    normal
}

/// The two coordinates along a box's face: upright faces have the height second.
#[inline]
pub(super) fn face_uv(point: &Vector3<f64>, face: usize) -> [f64; 2] {
    match face / 2 {
        0 => [point.z, point.y],
        1 => [point.x, point.z],
        _ => [point.x, point.y],
    }
}

/// A flat rectangle, painted on both sides alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    /// Middle, metres.
    pub centre: Vector3<f64>,
    /// From the middle to the middle of one edge, metres.
    pub half_u: Vector3<f64>,
    /// From the middle to the middle of the next edge, metres; orthogonal to `half_u`.
    pub half_v: Vector3<f64>,
}

impl Rectangle {
    #[inline]
    fn cross(&self, origin: &Vector3<f64>, unit: &Vector3<f64>) -> Option<(f64, usize)> {
        let normal = self.half_u.cross(&self.half_v);
        let range_m = normal.dot(&(self.centre - origin)) / normal.dot(unit);
        if !(range_m > 0.0 && range_m.is_finite()) {
            return None;
        }
        let offset = origin + unit * range_m - self.centre;
        let inside = offset.dot(&self.half_u).abs() <= self.half_u.norm_squared()
            && offset.dot(&self.half_v).abs() <= self.half_v.norm_squared();
        inside.then_some((range_m, 0))
    }

    #[inline]
    fn surface(&self, point: &Vector3<f64>, _: usize, unit: &Vector3<f64>) -> SurfacePoint {
        let normal = self.half_u.cross(&self.half_v).normalize();
        let offset = point - self.centre;
        SurfacePoint {
            normal: if normal.dot(unit) > 0.0 {
                -normal
            } else {
                normal
            },
            uv: [
                offset.dot(&self.half_u) / self.half_u.norm(),
                offset.dot(&self.half_v) / self.half_v.norm(),
            ],
            local: offset,
        }
    }
}
