//! Arcs of great circles and the pixels they bound: lengths, normals and solid angles.

use nalgebra::Vector3;

/// Chords shorter than this are a single point (the pole edges of a 360-degree image): the corners
/// of neighbouring pixels are rounded at 1e-16 and lie at least 1e-7 rad apart in any real camera.
const POINT: f64 = 1e-13;

/// The border between two neighbouring pixels: the arc of a great circle between two corners.
///
/// The normal n (unit, tangent to the sphere) is constant along the arc and points to the pixel of
/// larger x (or y), so that both integrals are exact. An arc without length (at a pole) has zeros.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Integral of n dl: the normal times the length of the arc in radians.
    pub normal_length: Vector3<f64>,
    /// Integral of (eta x n) dl: the chord, turned as eta x n is.
    pub tangent_length: Vector3<f64>,
    /// Unit ray to the middle of the arc.
    pub middle: Vector3<f64>,
}

impl Edge {
    /// The arc from `a` to `b` (unit rays) with the normal along `b x a`.
    pub(super) fn from_arc(a: &Vector3<f64>, b: &Vector3<f64>) -> Self {
        let chord = b - a;
        let middle = (a + b).normalize();
        if chord.norm() < POINT {
            return Self {
                normal_length: Vector3::zeros(),
                tangent_length: Vector3::zeros(),
                middle,
            };
        }
        // 2 asin(chord/2) and (b - a) x a lose no digits on short arcs, acos(a.b) and b x a would.
        let length = 2.0 * (0.5 * chord.norm()).min(1.0).asin();
        Self {
            normal_length: chord.cross(&middle).normalize() * length,
            tangent_length: chord,
            middle,
        }
    }

    /// True where the arc is a single point.
    pub(super) fn is_point(&self) -> bool {
        self.tangent_length == Vector3::zeros()
    }
}

/// Solid angle of the spherical triangle `a b c` (unit rays), steradians: positive where the
/// corners are met clockwise from inside the sphere (x right, y down).
///
/// van Oosterom and Strackee (1983), with the triple product taken of differences, which keeps
/// all digits of triangles much smaller than the sphere.
pub(super) fn triangle_solid_angle(a: &Vector3<f64>, b: &Vector3<f64>, c: &Vector3<f64>) -> f64 {
    let triple = a.dot(&(b - a).cross(&(c - a)));
    let cosines = 1.0 + a.dot(b) + b.dot(c) + c.dot(a);
    2.0 * triple.atan2(cosines)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

    /// Rounding of a handful of operations on numbers near 1.
    const ROUNDING: f64 = 1e-15;

    #[test]
    fn octant_of_the_sphere_has_half_pi_steradians() {
        let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
        assert!((triangle_solid_angle(&x, &y, &z) - FRAC_PI_2).abs() < ROUNDING);
        assert!((triangle_solid_angle(&x, &z, &y) + FRAC_PI_2).abs() < ROUNDING);
    }

    #[test]
    fn edge_integrals_agree_with_a_fine_sum_along_the_arc() {
        let a = Vector3::new(0.3, -0.4, 1.0).normalize();
        let b = Vector3::new(0.1, 0.9, 1.2).normalize();
        let edge = Edge::from_arc(&a, &b);
        let normal = b.cross(&a).normalize();
        let angle = a.dot(&b).acos();
        let steps = 4000;
        let mut tangents = Vector3::zeros();
        for step in 0..steps {
            let s = (f64::from(step) + 0.5) / f64::from(steps);
            let eta = (a * ((1.0 - s) * angle).sin() + b * (s * angle).sin()) / angle.sin();
            tangents += eta.cross(&normal) * (angle / f64::from(steps));
        }
        // The mid-point sum is second order: (angle / 4000)^2 / 24 = 2e-9.
        assert!((edge.tangent_length - tangents).norm() < 1e-8);
        assert!((edge.normal_length - normal * angle).norm() < 1e-14);
        assert!((edge.middle.dot(&a) - (0.5 * angle).cos()).abs() < ROUNDING);
    }

    #[test]
    fn edge_between_equal_corners_is_a_point_without_length() {
        let pole = Vector3::new(0.0, -1.0, 0.0);
        let edge = Edge::from_arc(&pole, &pole);
        assert!(edge.is_point() && edge.normal_length == Vector3::zeros());
        assert_eq!(edge.middle, pole);
    }

    #[test]
    fn quarter_arc_has_quarter_length() {
        let b = Vector3::new(1.0, 0.0, 1.0).normalize();
        let edge = Edge::from_arc(&Vector3::z(), &b);
        assert!((edge.normal_length.norm() - FRAC_PI_4).abs() < ROUNDING);
    }
}
