//! The operators against exact fields, at second order under refinement.

use super::fields::{self, Exact};
use crate::{Camera, SphereGrid};
use nalgebra::Vector3;

/// Errors below this are rounding (1e-16 over a squared pixel of 1e-3 rad), and have no order.
const ROUNDING: f64 = 1e-9;

/// Which rays count.
type Keep = fn(&Vector3<f64>) -> bool;

/// Errors of one operator on one grid: area-weighted L2 and maximum.
#[derive(Clone, Copy)]
struct Errors {
    l2: f64,
    max: f64,
}

fn errors(grid: &SphereGrid, keep: Keep, deviation: impl Fn(usize) -> f64) -> Errors {
    let (mut sum, mut area, mut max) = (0.0, 0.0, 0.0_f64);
    for (index, angle) in grid.solid_angle().iter().enumerate() {
        if angle.is_finite() && keep(&grid.rays()[index]) {
            let error = deviation(index);
            assert!(error.is_finite(), "no value at pixel {index}");
            sum += angle * error * error;
            area += angle;
            max = max.max(error);
        }
    }
    Errors {
        l2: (sum / area).sqrt(),
        max,
    }
}

/// Gradient, divergence and Laplacian errors of `exact` on the grid.
fn operator_errors(grid: &SphereGrid, exact: &dyn Exact, keep: Keep) -> [Errors; 3] {
    let scalar: Vec<f64> = grid.rays().iter().map(|ray| exact.value(ray)).collect();
    let vector: Vec<_> = grid.rays().iter().map(|ray| exact.vector(ray)).collect();
    let gradient = grid.gradient(&scalar).unwrap();
    let divergence = grid.divergence(&vector).unwrap();
    let laplacian = grid.laplacian(&scalar).unwrap();
    let ray = |index: usize| &grid.rays()[index];
    [
        errors(grid, keep, |i| {
            (gradient[i] - exact.gradient(ray(i))).norm()
        }),
        errors(grid, keep, |i| {
            (divergence[i] - exact.divergence(ray(i))).abs()
        }),
        errors(grid, keep, |i| {
            (laplacian[i] - exact.laplacian(ray(i))).abs()
        }),
    ]
}

const OPERATORS: [&str; 3] = ["gradient", "divergence", "laplacian"];

/// Orders of convergence below which a test fails, for gradient, divergence and Laplacian.
struct Orders {
    l2: [f64; 3],
    max: [f64; 3],
    /// The multiple of the coarsest grid from which on slopes count.
    from: usize,
}

/// Second order, up to the image border: the slope between the two finest grids of a doubling is
/// 2 but for higher terms, of which a tenth is allowed.
const SECOND: Orders = Orders {
    l2: [1.9; 3],
    max: [1.9; 3],
    from: 8,
};

/// The same on every doubling.
const SECOND_THROUGHOUT: Orders = Orders { from: 2, ..SECOND };

/// Where the rows beside the poles do not count.
fn away_from_poles(ray: &Vector3<f64>) -> bool {
    ray.y.abs() < 0.9
}

/// Doubles the resolution three times, prints the errors and checks the slopes.
fn check(name: &str, orders: &Orders, keep: Keep, camera: impl Fn(usize) -> Camera) {
    for (field, exact) in fields::all() {
        let mut last: Option<[Errors; 3]> = None;
        for n in [1, 2, 4, 8] {
            let grid = SphereGrid::new(&camera(n)).unwrap();
            let now = operator_errors(&grid, exact.as_ref(), keep);
            for (k, operator) in OPERATORS.iter().enumerate() {
                let slope = |of: fn(&Errors) -> f64| {
                    last.map_or(f64::NAN, |last| (of(&last[k]) / of(&now[k])).log2())
                };
                let (l2, max) = (slope(|e| e.l2), slope(|e| e.max));
                println!(
                    "{name:9} {field:12} {operator:10} x{n}: L2 {:8.2e} ({l2:4.2}) max {:8.2e} ({max:4.2})",
                    now[k].l2, now[k].max
                );
                let exact_already = now[k].max < ROUNDING;
                if n >= orders.from && !exact_already {
                    assert!(l2 > orders.l2[k], "{name} {field} {operator}: L2 {l2}");
                    assert!(max > orders.max[k], "{name} {field} {operator}: max {max}");
                }
            }
            last = Some(now);
        }
    }
}

fn anywhere(_: &Vector3<f64>) -> bool {
    true
}

#[test]
fn operators_on_a_pinhole_are_second_order_up_to_the_border() {
    check("pinhole", &SECOND, anywhere, |n| {
        let s = n as f64;
        Camera::pinhole(40.0 * s, 43.0 * s, 31.0 * s, 25.0 * s, 64 * n, 48 * n).unwrap()
    });
}

#[test]
fn operators_on_a_skewed_pinhole_are_second_order_up_to_the_border() {
    check("skewed", &SECOND, anywhere, |n| {
        let s = n as f64;
        Camera::pinhole_with_skew(
            40.0 * s,
            43.0 * s,
            31.0 * s,
            25.0 * s,
            15.0 * s,
            64 * n,
            48 * n,
        )
        .unwrap()
    });
}

#[test]
fn operators_on_the_whole_sphere_are_second_order_up_to_the_poles() {
    check("360", &SECOND_THROUGHOUT, anywhere, |n| {
        Camera::equirectangular(64 * n, 32 * n).unwrap()
    });
}

#[test]
fn operators_on_the_whole_sphere_away_from_the_poles_are_second_order_everywhere() {
    check("360 belt", &SECOND, away_from_poles, |n| {
        Camera::equirectangular(64 * n, 32 * n).unwrap()
    });
}

#[test]
fn operators_on_a_sphere_of_odd_width_converge_likewise() {
    check("360 odd", &SECOND_THROUGHOUT, anywhere, |n| {
        Camera::equirectangular(64 * n + 1, 32 * n).unwrap()
    });
}

#[test]
fn operators_on_a_sphere_of_oblong_pixels_converge_likewise() {
    check("360 tall", &SECOND, anywhere, |n| {
        Camera::equirectangular(96 * n, 24 * n).unwrap()
    });
    check("360 flat", &SECOND, anywhere, |n| {
        Camera::equirectangular(48 * n, 40 * n).unwrap()
    });
}

#[test]
fn operators_on_the_fov_fish_eye_are_second_order_up_to_the_border() {
    // 127 degrees from corner to corner.
    check("fov", &SECOND, anywhere, |n| {
        let s = n as f64;
        Camera::fov(36.0 * s, 36.0 * s, 31.0 * s, 25.0 * s, 0.9, 64 * n, 48 * n).unwrap()
    });
}

#[test]
fn operators_on_the_double_sphere_are_second_order_up_to_the_border() {
    check("double", &SECOND, anywhere, |n| {
        let s = n as f64;
        Camera::double_sphere(
            30.0 * s,
            31.0 * s,
            31.0 * s,
            25.0 * s,
            [-0.2, 0.6],
            64 * n,
            48 * n,
        )
        .unwrap()
    });
}

/// A fish-eye whose circle, 180 degrees across, lies within the image.
fn circle(n: usize) -> Camera {
    let s = n as f64;
    Camera::fov(18.0 * s, 18.0 * s, 31.2 * s, 31.8 * s, 0.9, 64 * n, 64 * n).unwrap()
}

fn away_from_the_rim(ray: &Vector3<f64>) -> bool {
    ray.z > 1.3_f64.cos()
}

#[test]
fn operators_inside_the_circle_of_a_fish_eye_are_second_order() {
    check("circle", &SECOND, away_from_the_rim, circle);
}
/// On the ragged rim a row may end where the next one goes on. The Laplacian's slope along an edge
/// is then one-sided on one side of a pixel and central on the other, of different errors: h in
/// the rim pixels, which are a share h of all, hence h^1.5 in the mean. (Measured: 0.86 and 1.44,
/// growing to 0.94 and 1.47 on the next doubling.)
const WITH_RIM: Orders = Orders {
    l2: [1.9, 1.9, 1.4],
    max: [1.9, 1.9, 0.8],
    from: 8,
};

#[test]
fn operators_in_the_rim_of_a_fish_eye_lose_an_order_in_the_laplacian_only() {
    check("rim", &WITH_RIM, anywhere, circle);
}

#[test]
fn pixels_outside_the_circle_of_a_fish_eye_are_unknown_everywhere() {
    let grid = SphereGrid::new(&circle(1)).unwrap();
    let field: Vec<f64> = grid.rays().iter().map(|ray| ray.x).collect();
    let (gradient, laplacian) = (
        grid.gradient(&field).unwrap(),
        grid.laplacian(&field).unwrap(),
    );
    assert!(!grid.is_valid(0, 0) && grid.is_valid(31, 31));
    for y in 0..64 {
        for x in 0..64 {
            let i = y * 64 + x;
            let known = grid.is_valid(x, y);
            let finite = |v: Vector3<f64>| v.iter().all(|v| v.is_finite());
            assert_eq!(finite(grid.ray(x, y)), known);
            assert_eq!(finite(gradient[i]), known);
            assert_eq!(laplacian[i].is_finite(), known);
        }
    }
    // A half sphere but for the pixels cut by its rim: 100 pixels of 2 degrees at most.
    let sum: f64 = grid.solid_angle().iter().filter(|a| a.is_finite()).sum();
    assert!((2.0 * std::f64::consts::PI - sum) / sum < 0.1 && sum < 2.0 * std::f64::consts::PI);
}
