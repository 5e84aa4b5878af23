//! A bundle of neighbouring rays, and the narrow pyramid and the cone around it.

use nalgebra::{Rotation3, Vector3};

/// Widening of an angle, radians, so that rounding leaves no ray out.
const MARGIN_RAD: f64 = 1e-9;

/// A cone around rays from one origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cone {
    pub axis: Vector3<f64>,
    pub half_angle_rad: f64,
    pub cos: f64,
    pub sin: f64,
}

impl Cone {
    pub(super) fn new(axis: Vector3<f64>, half_angle_rad: f64) -> Self {
        let (sin, cos) = half_angle_rad.sin_cos();
        Self {
            axis,
            half_angle_rad,
            cos,
            sin,
        }
    }

    /// True where some ray may be in both cones.
    #[inline]
    pub(super) fn meets(&self, other: &Self) -> bool {
        // Overlap where the angle between the axes is at most the sum of the half angles.
        self.half_angle_rad + other.half_angle_rad >= std::f64::consts::PI
            || self.axis.dot(&other.axis) >= self.cos * other.cos - self.sin * other.sin
    }
}

/// What encloses a few rays from one origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bundle {
    pub cone: Cone,
    /// Normals of planes through the origin that have no ray on their positive side; zero where
    /// there is no such plane.
    pub outward: [Vector3<f64>; 4],
}

impl Bundle {
    /// Around unit rays; NaN rays are left out, and without any ray it is the whole sphere.
    pub(super) fn around(rays: &[Vector3<f64>]) -> Self {
        let known = || rays.iter().filter(|ray| ray.x.is_finite());
        let mean: Vector3<f64> = known().sum();
        let Some(axis) = mean.try_normalize(1e-6) else {
            return Self {
                cone: Cone::new(Vector3::z(), std::f64::consts::PI),
                outward: [Vector3::zeros(); 4],
            };
        };
        let widest = known().map(|ray| ray.angle(&axis)).fold(0.0, f64::max);
        // The thin direction of an image row is across it: from the first to the last ray.
        let along = known().last().zip(known().next()).map(|(b, a)| b - a);
        let across = along.map_or(axis, |d| axis.cross(&d));
        let across = across
            .try_normalize(1e-9)
            .unwrap_or_else(|| any_across(&axis));
        let sideways = across.cross(&axis);
        let outward = [across, -across, sideways, -sideways].map(|side| {
            let angle = |ray: &Vector3<f64>| ray.dot(&side).atan2(ray.dot(&axis));
            let most = known().map(angle).fold(f64::NEG_INFINITY, f64::max) + MARGIN_RAD;
            if widest > 1.0 {
                return Vector3::zeros(); // too wide for a pyramid
            }
            side * most.cos() - axis * most.sin()
        });
        Self {
            cone: Cone::new(axis, widest + MARGIN_RAD),
            outward,
        }
    }

    /// The same rays in another frame.
    pub(super) fn turned(&self, rotation: &Rotation3<f64>) -> Self {
        Self {
            cone: Cone {
                axis: rotation * self.cone.axis,
                ..self.cone
            },
            outward: self.outward.map(|normal| rotation * normal),
        }
    }
}

/// Some unit vector at right angles to another.
fn any_across(axis: &Vector3<f64>) -> Vector3<f64> {
    let least = if axis.x.abs() < 0.6 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    axis.cross(&least).normalize()
}
