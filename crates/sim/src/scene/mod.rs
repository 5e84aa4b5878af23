//! A scene: painted solids, and the ray query that everything else is made of.

mod brush;
mod builtin;
mod ellipsoid;
mod furnished;
mod lattice;
mod shape;
mod solid;
mod texture;

pub(crate) use brush::Brush;
pub use ellipsoid::Ellipsoid;
pub use shape::{Rectangle, Room, Shape};
pub use solid::{Ball, Block, Cylinder};
pub use texture::Texture;

use nalgebra::Vector3;
use sphereflow_core::Error;

/// A surface with its paint.
#[derive(Clone, Debug, PartialEq)]
pub struct Primitive {
    /// The surface.
    pub shape: Shape,
    /// One texture a face, the last one serving the faces that are left; never empty.
    pub textures: Vec<Texture>,
}

impl Primitive {
    /// A shape with the same texture on all its faces.
    pub fn new(shape: impl Into<Shape>, texture: Texture) -> Self {
        Self {
            shape: shape.into(),
            textures: vec![texture],
        }
    }

    /// The texture of a face.
    pub(crate) fn texture(&self, face: usize) -> Texture {
        let last = self.textures.len().saturating_sub(1);
        self.textures
            .get(face.min(last))
            .copied()
            .unwrap_or(Texture::Plain { rgb: [128.0; 3] })
    }
}

/// What a ray meets first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the origin along the ray, metres: the thesis's D.
    pub range_m: f64,
    /// The point met, world frame, metres.
    pub point: Vector3<f64>,
    /// Unit normal there, world frame, on the side of the ray's origin.
    pub normal: Vector3<f64>,
    /// Index of the primitive.
    pub primitive: usize,
    /// Face of the primitive: 0 and 1 are -x and +x of a box, then y, then z.
    pub face: usize,
    /// Brightness, unquantised: nominally 0 to 255 (1 to 256 in the thesis's room).
    pub grey: f64,
    /// Colour, unquantised, same scale.
    pub rgb: [f64; 3],
}

/// Painted solids. Brightness belongs to the surface: it does not depend on where it is seen from
/// (thesis, section 1.2: Lambertian surfaces under constant light).
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    primitives: Vec<Primitive>,
    shading: f64,
}

impl Scene {
    /// From primitives.
    ///
    /// # Errors
    /// [`Error::Value`] without any primitive, or naming the size that is not positive.
    pub fn new(primitives: Vec<Primitive>) -> crate::Result<Self> {
        if primitives.is_empty() {
            return Err(Error::value("primitives", "at least one", 0).into());
        }
        for (index, primitive) in primitives.iter().enumerate() {
            let at = |what: &str| format!("primitives[{index}].{what}");
            if let Err((what, found)) = primitive.shape.check() {
                return Err(Error::value(at(what), "positive finite metres", found).into());
            }
            if primitive.textures.is_empty() {
                return Err(Error::value(at("textures"), "at least one", 0).into());
            }
            for texture in &primitive.textures {
                if let Err((what, found)) = texture.check() {
                    let what = at(&format!("textures: {what}"));
                    return Err(Error::value(what, "positive finite metres", found).into());
                }
            }
        }
        Ok(Self {
            primitives,
            shading: 0.0,
        })
    }

    /// The same scene lit from above and one side: brightness falls by up to `strength` (0 to 1)
    /// with the normal of the surface. Zero (the default) leaves the paint as it is.
    pub fn with_shading(mut self, strength: f64) -> Self {
        self.shading = strength.clamp(0.0, 1.0);
        self
    }

    /// The primitives.
    pub fn primitives(&self) -> &[Primitive] {
        &self.primitives
    }

    /// The first primitive that a camera at `point` would not see as it is: a solid that it is
    /// inside of, a room that it is outside of. `None` in free space.
    pub fn obstacle(&self, point: &Vector3<f64>) -> Option<usize> {
        self.primitives
            .iter()
            .position(|primitive| !primitive.shape.leaves_free(point))
    }

    /// What a ray from `origin` along `direction` (of any length but zero) meets first, in the
    /// world frame; `None` where it meets nothing. Exact to the rounding of `f64`.
    pub fn intersect(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<Hit> {
        let unit = direction.try_normalize(0.0)?;
        let mut nearest = None;
        for (index, primitive) in self.primitives.iter().enumerate() {
            nearest = primitive.shape.nearer(origin, &unit, index, nearest);
        }
        nearest.map(|crossing| self.describe(origin, &unit, crossing))
    }

    /// Share of the light that falls on a surface with a unit normal.
    #[inline]
    pub(crate) fn light(&self, normal: &Vector3<f64>) -> f64 {
        let lit = 0.5 + 0.5 * (0.30 * normal.x - 0.85 * normal.y - 0.43 * normal.z);
        1.0 - self.shading * (1.0 - lit)
    }

    /// Point, normal and paint of a crossing.
    fn describe(&self, origin: &Vector3<f64>, unit: &Vector3<f64>, crossing: Crossing) -> Hit {
        let point = origin + unit * crossing.range_m;
        let primitive = &self.primitives[crossing.primitive];
        let surface = primitive.shape.surface(&point, crossing.face, unit);
        let paint = primitive.texture(crossing.face).rgb(&surface, 0.0);
        let light = self.light(&surface.normal);
        let rgb = paint.map(|c| c * light);
        Hit {
            range_m: crossing.range_m,
            point,
            normal: surface.normal,
            primitive: crossing.primitive,
            face: crossing.face,
            grey: luminance(rgb),
            rgb,
        }
    }
}

/// ITU-R BT.601 weights, as [`sphereflow_core::RgbdFrame::grey`]; grey stays grey to the last bit.
pub(crate) fn luminance([r, g, b]: [f64; 3]) -> f64 {
    g + 0.299 * (r - g) + 0.114 * (b - g)
}

/// Where a ray crosses a primitive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    pub range_m: f64,
    pub primitive: usize,
    pub face: usize,
}

/// Geometry of a surface point, for the paint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Unit normal, world frame.
    pub normal: Vector3<f64>,
    /// Coordinates along the surface, metres.
    pub uv: [f64; 2],
    /// Coordinates in the frame of the primitive, metres.
    pub local: Vector3<f64>,
}
