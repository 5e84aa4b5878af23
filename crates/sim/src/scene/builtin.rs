//! The scenes of the thesis: its painted room, and the smooth surfaces that satisfy H1.

use super::{Ellipsoid, Primitive, Room, Scene, Texture};
use crate::Error;
use nalgebra::Vector3;

/// Half of the width (x), height (y) and length (z) of the room of section 4.1.1, metres.
const HALF_ROOM_M: [f64; 3] = [1.5, 2.25, 2.0];

/// Period of the paint, metres: the thesis only says that it is a sinusoid.
const THESIS_PERIOD_M: f64 = 0.5;

impl Scene {
    /// Thesis: section 4.1.1. The room of 3 x 4 x 4.5 m (width x, length z, height y) around the
    /// origin, painted with sinusoids of 0.5 m along both directions of each wall, 1 to 256.
    pub fn thesis_room() -> Self {
        Self::painted_room(THESIS_PERIOD_M)
    }

    /// The room of [`Scene::thesis_room`] with another period of the paint, metres.
    ///
    /// # Errors
    /// A value error where the period is not positive.
    pub fn thesis_room_with(period_m: f64) -> crate::Result<Self> {
        if !(period_m.is_finite() && period_m > 0.0) {
            return Err(Error::value("period_m", "positive finite metres", period_m));
        }
        Ok(Self::painted_room(period_m))
    }

    /// The inside of a sphere around the origin, painted with sinusoids of 0.5 m in space.
    ///
    /// # Errors
    /// A value error where the radius is not positive.
    pub fn sphere(radius_m: f64) -> crate::Result<Self> {
        Self::ellipsoid(radius_m, radius_m, radius_m)
    }

    /// The inside of an ellipsoid around the origin with half axes along x, y and z, metres,
    /// painted with sinusoids of 0.5 m in space.
    ///
    /// # Errors
    /// A value error where a half axis is not positive.
    pub fn ellipsoid(a_m: f64, b_m: f64, c_m: f64) -> crate::Result<Self> {
        Self::new(vec![painted_ellipsoid([a_m, b_m, c_m])])
    }

    /// The ellipsoid inscribed in the room of the thesis: closed, convex and smooth (H1).
    pub fn thesis_ellipsoid() -> Self {
        Self {
            primitives: vec![painted_ellipsoid(HALF_ROOM_M)],
            shading: 0.0,
        }
    }

    fn painted_room(period_m: f64) -> Self {
        let max = Vector3::from(HALF_ROOM_M);
        let room = Room { min: -max, max };
        Self {
            primitives: vec![Primitive::new(room, Texture::Sinusoid { period_m })],
            shading: 0.0,
        }
    }
}

fn painted_ellipsoid(semi_axes_m: [f64; 3]) -> Primitive {
    let ellipsoid = Ellipsoid {
        centre: Vector3::zeros(),
        semi_axes_m: semi_axes_m.into(),
    };
    let period_m = THESIS_PERIOD_M;
    Primitive::new(ellipsoid, Texture::SolidSinusoid { period_m })
}
