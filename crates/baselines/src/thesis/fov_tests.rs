//! Section 6.3's table against true contours, its printed form, and the pinhole it tends to.

use super::super::edge::contour;
use super::super::pinhole;
use super::*;
use nalgebra::Vector2;
use sphereflow_sphere::Camera;

/// Rounding and quadrature.
const EXACT: f64 = 1e-9;
/// The last one has the centre inside, the third one on a side, the second a corner on it.
const RECTANGLES: [[f64; 4]; 4] = [
    [0.1, 0.35, -0.4, -0.2],
    [0.0, 0.5, 0.0, 0.3],
    [-0.6, 0.3, 0.0, 0.4],
    [-0.7, 0.6, -0.5, 0.55],
];

/// The camera's own rays: the model of eq. (1.6), tested in its own crate.
fn ray(w: f64) -> impl Fn(f64, f64) -> Vector3<f64> {
    let camera = Camera::fov(1.0, 1.0, 0.0, 0.0, w, 1, 1).unwrap();
    move |z1, z2| camera.unproject(&Vector2::new(z1, z2)).unwrap()
}

/// Thesis: section 6.3: all eight entries, against the true contours.
#[test]
fn edge_integrates_to_the_true_contour() {
    for w in [0.3, 0.9, 1.4] {
        for rectangle in RECTANGLES {
            for side in Side::ALL {
                let expected = contour::of_rays(side, rectangle, ray(w));
                let (from, to) = contour::range(side, rectangle);
                let element = |t: f64| {
                    let (z1, z2) = contour::point(side, rectangle, t);
                    edge(w, side, z1, z2)
                };
                let tangent = contour::gauss(from, to, |t| element(t).tangent);
                let normal = contour::gauss(from, to, |t| element(t).normal);
                let errors = (
                    (tangent - expected.tangent).norm(),
                    (normal - expected.normal).norm(),
                );
                assert!(errors.0 < EXACT, "{w} {rectangle:?} {side:?} {errors:?}");
                assert!(errors.1 < EXACT, "{w} {rectangle:?} {side:?} {errors:?}");
            }
        }
    }
}

/// The rows as they are printed, the last with its correction.
fn printed(w: f64, side: Side, z1: f64, z2: f64) -> EdgeElement {
    let r = z1.hypot(z2);
    let ((s_w, c_w), (s_r, c_r)) = ((0.5 * w).sin_cos(), (r * w).sin_cos());
    let q2 = 4.0 * s_w * s_w * c_r * c_r + c_w * c_w * s_r * s_r;
    let mixed = c_w * c_w * s_r.powi(3) + 4.0 * s_w * s_w * c_r * (c_r * s_r - w * r);
    let along = |a: f64, b: f64| a * a * s_r * q2 + 4.0 * w * r * b * b * s_w * s_w * c_r;
    let across = |a: f64, b: f64| a * a * s_r * c_r + w * b * b * r;
    let off = 2.0 * r * r * w * c_w * s_r * s_w;
    let slant = 2.0 * z1 * z2 * s_w * (s_r * c_r - w * r);
    let axial = r * c_w * s_r * s_r;
    let (tangent, normal) = match side {
        Side::LowZ2 => (
            Vector3::new(along(z2, z1), -z1 * z2 * mixed, -z1 * off),
            Vector3::new(-slant, -2.0 * s_w * across(z2, z1), z2 * axial),
        ),
        Side::HighZ1 => (
            Vector3::new(-z1 * z2 * mixed, along(z1, z2), -z2 * off),
            Vector3::new(2.0 * s_w * across(z1, z2), slant, -z1 * axial),
        ),
        Side::HighZ2 => (
            Vector3::new(-along(z2, z1), z1 * z2 * mixed, z1 * off),
            Vector3::new(slant, 2.0 * s_w * across(z2, z1), -z2 * axial),
        ),
        Side::LowZ1 => (
            Vector3::new(z1 * z2 * mixed, -along(z1, z2), z2 * off),
            Vector3::new(-2.0 * s_w * across(z1, z2), -slant, z1 * axial),
        ),
    };
    let (r3, q3) = (r.powi(3), q2.powf(1.5));
    EdgeElement {
        tangent: tangent * (c_w / (r3 * q3)),
        normal: normal * (c_w / (r3 * q2)),
    }
}

/// Thesis: section 6.3: what is computed is what is printed, away from the centre.
#[test]
fn edge_is_the_printed_row_with_its_correction() {
    for side in Side::ALL {
        for (z1, z2) in [(0.3, 0.2), (-0.5, 0.1), (0.4, -0.7)] {
            let (ours, theirs) = (edge(0.9, side, z1, z2), printed(0.9, side, z1, z2));
            assert!((ours.tangent - theirs.tangent).norm() < 1e-13, "{side:?}");
            assert!((ours.normal - theirs.normal).norm() < 1e-13, "{side:?}");
        }
    }
}

/// Thesis: section 6.3: d sigma is the cross product of the sides, and has a limit at the centre.
#[test]
fn area_is_the_product_of_the_sides_up_to_the_centre() {
    for w in [0.3, 0.9, 1.4] {
        for (z1, z2) in [(0.3, 0.2), (1e-3, -2e-3), (1e-7, 0.0), (0.0, 0.0)] {
            let right = edge(w, Side::HighZ1, z1, z2).tangent; // d eta / dz2
            let up = edge(w, Side::LowZ2, z1, z2).tangent; // d eta / dz1
            let product = up.cross(&right).norm();
            assert!((area(w, z1, z2) - product).abs() < EXACT, "{w} {z1} {z2}");
        }
        let slope = 0.5 * w / (0.5 * w).tan();
        assert!((area(w, 0.0, 0.0) - slope * slope).abs() < EXACT);
        let (z1, z2): (f64, f64) = (0.4, -0.3);
        let (r, t) = (z1.hypot(z2), (z1.hypot(z2) * w).tan());
        let tan_w = (0.5 * w).tan();
        let printed = 2.0 * w * t / tan_w.powi(2) * (1.0 + t * t)
            / (r * (4.0 + (t / tan_w).powi(2)).powf(1.5));
        assert!((area(w, z1, z2) - printed).abs() < 1e-12, "{printed}");
    }
}

#[test]
fn edge_of_a_lens_without_distortion_is_the_pinhole() {
    /// The lens bends by w^2.
    const W: f64 = 1e-5;
    for side in Side::ALL {
        let (ours, straight) = (edge(W, side, 0.4, -0.3), pinhole::edge(side, 0.4, -0.3));
        assert!((ours.tangent - straight.tangent).norm() < EXACT);
        assert!((ours.normal - straight.normal).norm() < EXACT);
    }
    assert!((area(W, 0.4, -0.3) - pinhole::area(0.4, -0.3)).abs() < EXACT);
}

#[test]
fn third_is_smooth_where_series_and_closed_form_meet() {
    let closed = |t: f64| (t - t.sin()) / (t * t * t);
    assert!((third(0.999_999) - closed(0.999_999)).abs() < 1e-15);
    assert!((third(0.0) - 1.0 / 6.0).abs() < 1e-16);
    assert!((third(0.1) - closed(0.1)).abs() < 1e-12); // of the closed form's own digits
}
