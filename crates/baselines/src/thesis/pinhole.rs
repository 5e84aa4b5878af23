//! The table of section 6.2: edges and areas of rectangles in the image of a pinhole camera.
//!
//! Image plane coordinates `z1 = (i - cx) / fx`, `z2 = (j - cy) / fy`. The table is printed right
//! but for the intervals of its rows 3 and 4, written backwards: lengths are positive and normals
//! point outward.

use super::edge::{EdgeElement, Side};
use nalgebra::Vector3;

/// Thesis: section 6.2. `d sigma / (dz1 dz2)`, steradian per unit of image plane.
pub fn area(z1: f64, z2: f64) -> f64 {
    (1.0 + z1 * z1 + z2 * z2).powf(-1.5)
}

/// Thesis: section 6.2. The row of `side`, at a point of it.
pub fn edge(side: Side, z1: f64, z2: f64) -> EdgeElement {
    let norm2 = 1.0 + z1 * z1 + z2 * z2;
    let (tangent, normal) = if side.is_level() {
        (
            Vector3::new(-(1.0 + z2 * z2), z1 * z2, z1),
            Vector3::new(0.0, 1.0, -z2),
        )
    } else {
        (
            Vector3::new(-z1 * z2, 1.0 + z1 * z1, -z2),
            Vector3::new(1.0, 0.0, -z1),
        )
    };
    EdgeElement {
        tangent: tangent * (side.sign() * norm2.powf(-1.5)),
        normal: normal * (side.sign() / norm2),
    }
}

/// The row of `side` integrated along it in closed form: `at` is the coordinate that stays, `from`
/// and `to` are the ends of the one that runs.
pub fn edge_integral(side: Side, at: f64, from: f64, to: f64) -> EdgeElement {
    let ray = |t: f64| {
        let (z1, z2) = if side.is_level() { (t, at) } else { (at, t) };
        Vector3::new(z1, z2, 1.0).normalize()
    };
    let chord = ray(to) - ray(from);
    let root = (1.0 + at * at).sqrt();
    let angle = ((to / root).atan() - (from / root).atan()) / root;
    let (tangent, normal) = if side.is_level() {
        (-chord, Vector3::new(0.0, 1.0, -at))
    } else {
        (chord, Vector3::new(1.0, 0.0, -at))
    };
    EdgeElement {
        tangent: tangent * side.sign(),
        normal: normal * (side.sign() * angle),
    }
}

#[cfg(test)]
mod tests {
    use super::super::edge::contour;
    use super::*;
    use sphereflow_sphere::SphereGrid;

    /// Rounding and quadrature.
    const EXACT: f64 = 1e-9;
    const RECTANGLES: [[f64; 4]; 3] = [
        [-0.6, 0.5, -0.4, 0.45],
        [0.1, 0.35, -0.4, -0.2],
        [-1.5, -1.2, 0.7, 1.9],
    ];

    fn ray(z1: f64, z2: f64) -> Vector3<f64> {
        Vector3::new(z1, z2, 1.0).normalize()
    }

    /// Thesis: section 6.2: all eight entries, against the true contours.
    #[test]
    fn edge_integrates_to_the_true_contour() {
        for rectangle in RECTANGLES {
            for side in Side::ALL {
                let expected = contour::of_rays(side, rectangle, ray);
                let (from, to) = contour::range(side, rectangle);
                let element = |t: f64| {
                    let (z1, z2) = contour::point(side, rectangle, t);
                    edge(side, z1, z2)
                };
                let tangent = contour::gauss(from, to, |t| element(t).tangent);
                let normal = contour::gauss(from, to, |t| element(t).normal);
                assert!((tangent - expected.tangent).norm() < EXACT, "{side:?}");
                assert!((normal - expected.normal).norm() < EXACT, "{side:?}");
                let (z1, z2) = contour::point(side, rectangle, from);
                let at = if side.is_level() { z2 } else { z1 };
                let closed = edge_integral(side, at, from, to);
                assert!((closed.tangent - expected.tangent).norm() < EXACT);
                assert!((closed.normal - expected.normal).norm() < EXACT);
            }
        }
    }

    #[test]
    fn edge_normal_is_a_unit_vector_of_the_sphere_that_points_outward() {
        for side in Side::ALL {
            let (z1, z2) = (0.3, -0.2);
            let (eta, element) = (ray(z1, z2), edge(side, z1, z2));
            let outward = match side {
                Side::LowZ2 => -Vector3::y(),
                Side::HighZ1 => Vector3::x(),
                Side::HighZ2 => Vector3::y(),
                Side::LowZ1 => -Vector3::x(),
            };
            assert!(element.normal.dot(&outward) > 0.0, "{side:?}");
            assert!(element.normal.dot(&eta).abs() < 1e-15, "{side:?}");
            assert!((eta.cross(&element.normal) - element.tangent).norm() < 1e-15);
        }
    }

    /// Thesis: section 6.2: d sigma, against the solid angle that four rays span.
    #[test]
    fn area_integrates_to_the_true_solid_angle() {
        for [a1, b1, a2, b2] in RECTANGLES {
            let integral = contour::gauss(a1, b1, |z1| {
                contour::gauss(a2, b2, |z2| Vector3::repeat(area(z1, z2)))
            });
            let corners = [ray(a1, a2), ray(b1, a2), ray(b1, b2), ray(a1, b2)];
            let expected = triangle(corners[0], corners[1], corners[2])
                + triangle(corners[0], corners[2], corners[3]);
            assert!((integral.x - expected).abs() < EXACT, "{integral}");
        }
    }

    /// Solid angle of a triangle of rays (van Oosterom and Strackee 1983).
    fn triangle(a: Vector3<f64>, b: Vector3<f64>, c: Vector3<f64>) -> f64 {
        let volume = a.dot(&b.cross(&c)).abs();
        2.0 * volume.atan2(1.0 + a.dot(&b) + b.dot(&c) + c.dot(&a))
    }

    /// The engine's own grid has the same edges, in closed form.
    #[test]
    fn edge_integral_is_that_of_the_sphere_grid() {
        let camera = sphereflow_sphere::Camera::pinhole(50.0, 48.0, 31.5, 23.5, 64, 48).unwrap();
        let grid = SphereGrid::new(&camera).unwrap();
        let z1 = |x: f64| (x - 31.5) / 50.0;
        let z2 = |y: f64| (y - 23.5) / 48.0;
        let right = edge_integral(Side::HighZ1, z1(10.5), z2(6.5), z2(7.5));
        let theirs = grid.edge_x(11, 7);
        assert!((right.tangent - theirs.tangent_length).norm() < EXACT);
        assert!((right.normal - theirs.normal_length).norm() < EXACT);
        let below = edge_integral(Side::HighZ2, z2(6.5), z1(10.5), z1(11.5));
        let theirs = grid.edge_y(11, 7);
        assert!((below.tangent - theirs.tangent_length).norm() < EXACT);
        assert!((below.normal - theirs.normal_length).norm() < EXACT);
    }
}
