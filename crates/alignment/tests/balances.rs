//! The balances of Chapter 6 on exact ranges: the printed one in D^3, ours in 1/D, and the sign.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

mod scene;

use nalgebra::Vector3;
use scene::{Scene, somewhere, twist};
use sphereflow_alignment::pose_from_twist;
use sphereflow_core::Twist;
use sphereflow_sphere::{Camera, Edge, SphereGrid};

/// The mid-point rule on pixels of 0.7 degrees, relative to the largest term.
const MID_POINT: f64 = 2e-4;

/// A domain of pixels on the whole sphere: columns and rows from, up to.
const DOMAINS: [[usize; 4]; 3] = [[200, 300, 90, 160], [10, 60, 30, 70], [380, 500, 120, 220]];

fn grid() -> SphereGrid {
    SphereGrid::new(&Camera::equirectangular(512, 256).unwrap()).unwrap()
}

/// The edges of a domain, with the sign that turns their normals outward.
fn contour(grid: &SphereGrid, [x0, x1, y0, y1]: [usize; 4]) -> Vec<(&Edge, f64)> {
    let upright = (y0..y1).flat_map(|y| [(grid.edge_x(x1, y), 1.0), (grid.edge_x(x0, y), -1.0)]);
    let level = (x0..x1).flat_map(|x| [(grid.edge_y(x, y1), 1.0), (grid.edge_y(x, y0), -1.0)]);
    upright.chain(level).collect()
}

/// Integral over a domain of a function of the ray.
fn inside(
    grid: &SphereGrid,
    [x0, x1, y0, y1]: [usize; 4],
    f: impl Fn(&Vector3<f64>) -> f64,
) -> f64 {
    let pixels = (y0..y1).flat_map(|y| (x0..x1).map(move |x| (x, y)));
    pixels
        .map(|(x, y)| f(&grid.ray(x, y)) * grid.solid_angle()[y * grid.width() + x])
        .sum()
}

/// Range along a ray of the camera `time_s` after its pose `somewhere`.
fn range(motion: &Twist, time_s: f64, ray: &Vector3<f64>) -> f64 {
    let pose = somewhere() * pose_from_twist(motion, time_s);
    let ellipsoid = Scene::Ellipsoid(Vector3::new(2.0, 1.5, 2.5));
    ellipsoid.range(&pose.translation, &(pose.rotation * ray))
}

/// Both sides of the balance of a function F of the range, with G' = F'/D: the rate of its
/// integral, and the contour and inside terms for the true twist.
fn balance(
    domain: [usize; 4],
    f: impl Fn(f64) -> f64,
    g: impl Fn(f64) -> f64,
    source: impl Fn(f64) -> f64,
) -> (f64, f64) {
    const STEP_S: f64 = 1e-4;
    let motion = twist([0.3, -0.4, 0.2, 0.25, -0.1, 0.3]);
    let (omega, v) = (motion.angular_rad_s, motion.linear_m_s);
    let grid = grid();
    let at = |time_s: f64| inside(&grid, domain, |ray| f(range(&motion, time_s, ray)));
    let rate = (at(STEP_S) - at(-STEP_S)) / (2.0 * STEP_S);
    let around: f64 = contour(&grid, domain)
        .iter()
        .map(|(edge, outward)| {
            let d = range(&motion, 0.0, &edge.middle);
            let turning = edge.tangent_length.dot(&omega) * f(d);
            outward * (turning + edge.normal_length.dot(&v) * g(d))
        })
        .sum();
    let within = inside(&grid, domain, |ray| {
        source(range(&motion, 0.0, ray)) * ray.dot(&v)
    });
    (rate, around + within)
}

/// Thesis: eq. (6.2), eq. (6.3): the balance of D^3, as printed.
#[test]
fn balance_of_cubed_range_holds_as_printed() {
    for domain in DOMAINS {
        let (rate, terms) = balance(domain, |d| d.powi(3), |d| 1.5 * d * d, |_| 0.0);
        assert!(
            (rate - terms).abs() < MID_POINT * rate.abs().max(1.0),
            "{rate} {terms}"
        );
    }
}

/// The balance that the estimator solves: F = 1/D, G = 1/(2 D^2), source 2 / D^2.
#[test]
fn balance_of_inverse_range_holds() {
    for domain in DOMAINS {
        let (rate, terms) = balance(domain, |d| 1.0 / d, |d| 0.5 / (d * d), |d| 2.0 / (d * d));
        assert!(
            (rate - terms).abs() < MID_POINT * rate.abs().max(0.05),
            "{rate} {terms}"
        );
    }
}

/// Thesis: section 6.1 has `div(eta x (eta x P)) = -2 eta.P`; it is `+2 eta.P`.
#[test]
fn divergence_of_double_product_is_plus_two_eta_p() {
    let p = Vector3::new(0.3, -0.7, 0.5);
    let grid = grid();
    for domain in DOMAINS {
        // (eta x (eta x P)).n = -P.n for n tangent to the sphere
        let edges = contour(&grid, domain);
        let outflow: f64 = edges
            .iter()
            .map(|(e, outward)| -outward * e.normal_length.dot(&p))
            .sum();
        let integral = inside(&grid, domain, |eta| 2.0 * eta.dot(&p));
        assert!(
            (outflow - integral).abs() < MID_POINT,
            "{outflow} {integral}"
        );
    }
}
