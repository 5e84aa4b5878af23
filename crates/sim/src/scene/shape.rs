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
    #[inline(always)]
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
    pub(crate) fn surface(
        &self,
        point: &Vector3<f64>,
        face: usize,
        unit: &Vector3<f64>,
    ) -> SurfacePoint {
        on_shape!(self, s => s.surface(point, face, unit))
    }

    /// [`Shape::surface`] of many points of one face: `rays` are points and unit rays.
    pub(crate) fn surfaces(
        &self,
        face: usize,
        rays: impl Iterator<Item = (Vector3<f64>, Vector3<f64>)>,
        out: &mut [SurfacePoint],
    ) {
        on_shape!(self, s => {
            for (out, (point, unit)) in out.iter_mut().zip(rays) {
                *out = s.surface(&point, face, &unit);
            }
        });
    }

    /// Centre and radius of a ball around it; `None` for what surrounds the camera.
    pub(crate) fn bounding_ball(&self) -> Option<(Vector3<f64>, f64)> {
        match self {
            Self::Room(_) | Self::Ellipsoid(_) => None,
            Self::Block(s) => Some((s.centre, s.half_size_m.norm())),
            Self::Ball(s) => Some((s.centre, s.radius_m)),
            Self::Cylinder(s) => Some((s.centre, s.radius_m.hypot(s.half_height_m))),
            Self::Rectangle(s) => Some((s.centre, s.half_m[0].hypot(s.half_m[1]))),
        }
    }

    /// The least coordinate of its points along `normal` from the world's origin, for a unit normal
    /// in metres; minus infinity for what surrounds the camera.
    #[inline]
    pub(crate) fn least_along(&self, normal: &Vector3<f64>) -> f64 {
        match self {
            Self::Room(_) | Self::Ellipsoid(_) => f64::NEG_INFINITY,
            Self::Block(s) => s.least_along(normal),
            Self::Ball(s) => normal.dot(&s.centre) - s.radius_m * normal.norm(),
            Self::Cylinder(s) => {
                let upright = normal.y.abs() * s.half_height_m;
                normal.dot(&s.centre) - upright - s.radius_m * normal.x.hypot(normal.z)
            }
            Self::Rectangle(s) => {
                let [u, v] = s.along.map(|edge| edge.dot(normal).abs());
                normal.dot(&s.centre) - u * s.half_m[0] - v * s.half_m[1]
            }
        }
    }

    /// True where a camera at `point` would see the shape as it is: outside a solid, inside what
    /// surrounds it.
    pub(crate) fn leaves_free(&self, point: &Vector3<f64>) -> bool {
        match self {
            Self::Room(s) => (0..3).all(|i| point[i] > s.min[i] && point[i] < s.max[i]),
            Self::Ellipsoid(s) => s.contains(point),
            Self::Block(s) => !s.contains(point),
            Self::Ball(s) => (point - s.centre).norm() > s.radius_m,
            Self::Cylinder(s) => !s.contains(point),
            Self::Rectangle(_) => true,
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
            Self::Rectangle(s) => positive("half_u, half_v", &s.half_m),
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
    match face {
        0 => -Vector3::x(),
        1 => Vector3::x(),
        2 => -Vector3::y(),
        3 => Vector3::y(),
        4 => -Vector3::z(),
        _ => Vector3::z(),
    }
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
    centre: Vector3<f64>,
    /// Unit vectors along the edges, and half of the edges' lengths.
    along: [Vector3<f64>; 2],
    half_m: [f64; 2],
    normal: Vector3<f64>,
}

impl Rectangle {
    /// From its middle, the vector from there to the middle of one edge, and the one to the middle
    /// of the next edge, metres. Of `half_v` only what is orthogonal to `half_u` counts.
    pub fn new(centre: Vector3<f64>, half_u: Vector3<f64>, half_v: Vector3<f64>) -> Self {
        let u = half_u.normalize();
        let half_v = half_v - u * u.dot(&half_v);
        let v = half_v.normalize();
        Self {
            centre,
            along: [u, v],
            half_m: [half_u.norm(), half_v.norm()],
            normal: u.cross(&v),
        }
    }

    #[inline]
    fn cross(&self, origin: &Vector3<f64>, unit: &Vector3<f64>) -> Option<(f64, usize)> {
        let range_m = self.normal.dot(&(self.centre - origin)) / self.normal.dot(unit);
        if !(range_m > 0.0 && range_m.is_finite()) {
            return None;
        }
        let offset = origin + unit * range_m - self.centre;
        let inside = offset.dot(&self.along[0]).abs() <= self.half_m[0]
            && offset.dot(&self.along[1]).abs() <= self.half_m[1];
        inside.then_some((range_m, 0))
    }

    #[inline]
    fn surface(&self, point: &Vector3<f64>, _: usize, unit: &Vector3<f64>) -> SurfacePoint {
        let offset = point - self.centre;
        let away = self.normal.dot(unit) > 0.0;
        SurfacePoint {
            normal: if away { -self.normal } else { self.normal },
            uv: self.along.map(|edge| offset.dot(&edge)),
            local: offset,
        }
    }
}
