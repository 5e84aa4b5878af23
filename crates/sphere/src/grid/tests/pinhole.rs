//! The grid against the thesis's formulas in pinhole coordinates, differenced independently.

use super::fields::{Exact, Exponential};
use crate::{Camera, SphereGrid, laplacian_discrepancy};
use nalgebra::Vector3;

/// Step of the independent differences, in pinhole coordinates: at sixth order the error is
/// about 1e-13 and the rounding 1e-14 for a first derivative, 1e-12 for nested ones.
const STEP: f64 = 0.01;
/// What nested sixth-order differences of fields near 1 are good for.
const DIFFERENCES: f64 = 1e-9;

/// Sixth-order central difference of `f` at `t`.
fn derivative(f: impl Fn(f64) -> f64, t: f64) -> f64 {
    let pair = |k: f64| f(t + k * STEP) - f(t - k * STEP);
    (45.0 * pair(1.0) - 9.0 * pair(2.0) + pair(3.0)) / (60.0 * STEP)
}

fn eta(z1: f64, z2: f64) -> Vector3<f64> {
    Vector3::new(z1, z2, 1.0).normalize()
}

/// Thesis: eq. (2.16), the right-hand side over alpha^2: the Laplacian of `f(z1, z2)`.
fn printed_laplacian(f: &dyn Fn(f64, f64) -> f64, z1: f64, z2: f64) -> f64 {
    let n = |a: f64, b: f64| (1.0 + a * a + b * b).sqrt();
    let f1 = |a: f64, b: f64| derivative(|t| f(t, b), a);
    let f2 = |a: f64, b: f64| derivative(|t| f(a, t), b);
    let terms = derivative(|a| (1.0 + a * a) / n(a, z2) * f1(a, z2), z1)
        + derivative(|b| (1.0 + b * b) / n(z1, b) * f2(z1, b), z2)
        + derivative(|b| z1 * b / n(z1, b) * f1(z1, b), z2)
        + derivative(|a| a * z2 / n(a, z2) * f2(a, z2), z1);
    n(z1, z2).powi(3) * terms
}

/// Thesis: eq. (1.21), the gradient from the two derivatives in pinhole coordinates.
fn printed_gradient(f: &dyn Fn(f64, f64) -> f64, z1: f64, z2: f64) -> Vector3<f64> {
    let (f1, f2) = (derivative(|t| f(t, z2), z1), derivative(|t| f(z1, t), z2));
    Vector3::new(f1, f2, -z1 * f1 - z2 * f2) * (1.0 + z1 * z1 + z2 * z2).sqrt()
}

fn exact() -> Exponential {
    Exponential(Vector3::new(0.7, -0.9, 0.5), Vector3::new(-0.4, 0.6, 1.1))
}

const POINTS: [(f64, f64); 4] = [(0.0, 0.0), (0.4, -0.3), (-0.6, 0.5), (0.2, 0.7)];

#[test]
fn printed_formulas_are_the_gradient_and_the_laplacian_of_the_sphere() {
    // Thesis: eq. (1.20): the third component follows from the orthogonality to eta.
    for (z1, z2) in POINTS {
        let f = |a: f64, b: f64| exact().value(&eta(a, b));
        let gradient = printed_gradient(&f, z1, z2);
        assert!((gradient - exact().gradient(&eta(z1, z2))).norm() < DIFFERENCES);
        assert!(gradient.dot(&Vector3::new(z1, z2, 1.0)).abs() < DIFFERENCES);
        let laplacian = printed_laplacian(&f, z1, z2);
        assert!((laplacian - exact().laplacian(&eta(z1, z2))).abs() < DIFFERENCES);
    }
}

#[test]
fn change_of_eta_by_pinhole_coordinates_is_the_printed_one() {
    // Thesis: eq. (1.18), and eq. (1.19): dy = grad y . d eta.
    for (z1, z2) in POINTS {
        let n3 = (1.0 + z1 * z1 + z2 * z2).powf(1.5);
        let by_z1 = Vector3::new(1.0 + z2 * z2, -z1 * z2, -z1) / n3;
        let by_z2 = Vector3::new(-z1 * z2, 1.0 + z1 * z1, -z2) / n3;
        let gradient = exact().gradient(&eta(z1, z2));
        for (axis, column) in [(0, by_z1), (1, by_z2)] {
            let at = |t: f64| if axis == 0 { eta(t, z2) } else { eta(z1, t) };
            let here = if axis == 0 { z1 } else { z2 };
            for k in 0..3 {
                assert!((derivative(|t| at(t)[k], here) - column[k]).abs() < DIFFERENCES);
            }
            let change = derivative(|t| exact().value(&at(t)), here);
            assert!((gradient.dot(&column) - change).abs() < DIFFERENCES);
        }
    }
}

/// The 640x480 camera of 60 by 50 degrees.
fn camera() -> Camera {
    let focal = |pixels: f64, degrees: f64| 0.5 * pixels / (0.5 * degrees).to_radians().tan();
    Camera::pinhole(
        focal(640.0, 60.0),
        focal(480.0, 50.0),
        319.5,
        239.5,
        640,
        480,
    )
    .unwrap()
}

/// Calls `visit(index, z1, z2)` on pixels spread over the image, corners included.
fn visit_pixels(grid: &SphereGrid, mut visit: impl FnMut(usize, f64, f64)) {
    for y in (0..480).step_by(479 / 5).chain([479]) {
        for x in (0..640).step_by(639 / 7).chain([639]) {
            let ray = grid.ray(x, y);
            visit(y * 640 + x, ray.x / ray.z, ray.y / ray.z);
        }
    }
}

#[test]
fn grid_gradient_is_the_printed_one_in_pinhole_coordinates() {
    // Thesis: eq. (1.21).
    let grid = SphereGrid::new(&camera()).unwrap();
    let f = |a: f64, b: f64| exact().value(&eta(a, b));
    let field: Vec<f64> = grid.rays().iter().map(|ray| exact().value(ray)).collect();
    let gradient = grid.gradient(&field).unwrap();
    visit_pixels(&grid, |index, z1, z2| {
        // Second order on pixels of 1.8e-3 rad: 3e-6 times third derivatives of about 2.
        assert!((gradient[index] - printed_gradient(&f, z1, z2)).norm() < 1e-5);
    });
}

#[test]
fn grid_laplacian_is_the_printed_one_in_pinhole_coordinates() {
    // Thesis: eq. (2.16).
    let grid = SphereGrid::new(&camera()).unwrap();
    let f = |a: f64, b: f64| exact().value(&eta(a, b));
    let field: Vec<f64> = grid.rays().iter().map(|ray| exact().value(ray)).collect();
    let laplacian = grid.laplacian(&field).unwrap();
    visit_pixels(&grid, |index, z1, z2| {
        // Second order: 3e-6 times fourth derivatives, of which extrapolation to the border takes
        // several times what the interior does; the worst is a corner, 1.05e-4.
        assert!((laplacian[index] - printed_laplacian(&f, z1, z2)).abs() < 2e-4);
    });
}

#[test]
fn wall_has_minus_twice_its_inverse_range_as_laplacian() {
    // Thesis: section 2.2.1: Gamma = Gamma_0 / n has Delta_R = -2 Gamma, Delta_E as printed.
    let gamma = |a: f64, b: f64| 0.5 / (1.0 + a * a + b * b).sqrt();
    let grid = SphereGrid::new(&camera()).unwrap();
    let field: Vec<f64> = grid.rays().iter().map(|ray| 0.5 * ray.z).collect();
    let laplacian = grid.laplacian(&field).unwrap();
    visit_pixels(&grid, |index, z1, z2| {
        let riemannian = -2.0 * gamma(z1, z2);
        assert!((printed_laplacian(&gamma, z1, z2) - riemannian).abs() < DIFFERENCES);
        assert!((laplacian[index] - riemannian).abs() < 1e-4);
        let twice = |f: &dyn Fn(f64) -> f64, t| derivative(|s| derivative(f, s), t);
        let euclidean = twice(&|t| gamma(t, z2), z1) + twice(&|t| gamma(z1, t), z2);
        let r2 = z1 * z1 + z2 * z2;
        assert!((euclidean - 0.5 * (r2 - 2.0) / (1.0 + r2).powf(2.5)).abs() < DIFFERENCES);
        // Thesis: Figure 2.1.
        let percent = 100.0 * ((euclidean - riemannian) / euclidean).abs();
        assert!((percent - laplacian_discrepancy(z1, z2)).abs() < 1e-6);
    });
}
