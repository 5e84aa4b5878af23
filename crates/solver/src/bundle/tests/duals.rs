//! Every Jacobian against dual numbers: cameras, points, ranges, priors, free intrinsics, losses.

use super::derivatives::{cameras, sample};
use crate::bundle::measurement::Measurement;
use crate::bundle::{BundleAdjuster, BundleProblem};
use crate::dual::{Dual, Square, c, matrix, nudge, squared, tangent};
use crate::minimise::System;
use crate::{Damping, LinearSolver, Loss};
use sphereflow_sphere::Camera;

/// Rounding of a few hundred products, relative to the largest entry; central differences of a
/// model's own parameters are the exception.
const RELATIVE: f64 = 1e-11;
/// Central differences with a step of 1e-5.
const BY_DIFFERENCES: f64 = 1e-7;

/// A camera model written a second time, with parameters that may be moved.
fn project(model: &str, p: &dyn Fn(&str) -> Dual, [x, y, z]: [Dual; 3]) -> [Dual; 2] {
    let one = c(1.0);
    let (u, v) = (x / z, y / z);
    let r = (x * x + y * y).sqrt();
    let m = match model {
        "pinhole" => [u + p("skew") / p("fx") * v, v],
        "opencv" => {
            let s = u * u + v * v;
            let above = one + s * (p("k1") + s * (p("k2") + s * p("k3")));
            let below = one + s * (p("k4") + s * (p("k5") + s * p("k6")));
            let (radial, two) = (above / below, c(2.0));
            let (p1, p2) = (p("p1"), p("p2"));
            [
                u * radial + two * p1 * u * v + p2 * (s + two * u * u),
                v * radial + p1 * (s + two * v * v) + two * p2 * u * v,
            ]
        }
        "fov" => {
            let half = (p("w") * c(0.5)).tan();
            let bent = (c(2.0) * (r / z) * half).atan2(one) / p("w");
            [x / r * bent, y / r * bent]
        }
        "kannala_brandt" => {
            let t = r.atan2(z);
            let s = t * t;
            let terms = s * (p("k1") + s * (p("k2") + s * (p("k3") + s * p("k4"))));
            let bent = t * (one + terms);
            [x / r * bent, y / r * bent]
        }
        "double_sphere" => {
            let d1 = (r * r + z * z).sqrt();
            let ahead = p("xi") * d1 + z;
            let d2 = (r * r + ahead * ahead).sqrt();
            let by = p("alpha") * d2 + (one - p("alpha")) * ahead;
            [x / by, y / by]
        }
        other => {
            assert_eq!(other, "equirectangular");
            let pi = c(std::f64::consts::PI);
            let flat = (x * x + z * z).sqrt();
            let (lon, lat) = (x.atan2(z) + pi, y.atan2(flat) + pi * c(0.5));
            // 800 x 400 pixels
            let scale = c(400.0) / pi;
            return [lon * scale - c(0.5), lat * scale - c(0.5)];
        }
    };
    [m[0] * p("fx") + p("cx"), m[1] * p("fy") + p("cy")]
}

fn rho(loss: Loss, s: Dual) -> Dual {
    let one = c(1.0);
    match loss {
        Loss::Quadratic => s,
        Loss::Huber(k) if s.v <= k * k => s,
        Loss::Huber(k) => c(2.0 * k) * s.sqrt() - c(k * k),
        Loss::Cauchy(k) => c(k * k) * (one + s / c(k * k)).ln(),
        Loss::Tukey(k) if s.v > k * k => c(k * k / 3.0),
        Loss::Tukey(k) => {
            let rest = one - s / c(k * k);
            c(k * k / 3.0) * (one - rest * rest * rest)
        }
    }
}

/// What is moved by epsilon.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Moved<'a> {
    Pose(usize, usize),
    Point(usize, usize),
    Intrinsic(&'a str),
}

fn cost(problem: &BundleProblem, moved: Moved) -> Dual {
    let epsilon = Dual { v: 0.0, d: 1.0 };
    let poses: Vec<Square<4>> = (0..problem.poses())
        .map(|k| {
            let here = matrix(&problem.pose(k).unwrap().inverse(), 1.0);
            match moved {
                // the update is from the left
                Moved::Pose(pose, axis) if pose == k => nudge(axis).times(&here),
                _ => here,
            }
        })
        .collect();
    let camera = problem.camera(0).unwrap();
    let named = camera.named_parameters();
    let parameter = |name: &str| {
        let found = named.iter().find(|(known, _)| *known == name);
        let value = c(found.map_or(0.0, |(_, value)| *value));
        match moved {
            Moved::Intrinsic("focal") if name == "fx" => value + epsilon,
            Moved::Intrinsic("focal") if name == "fy" => {
                let fx = named.iter().find(|(known, _)| *known == "fx").unwrap().1;
                value + epsilon * c(value.v / fx)
            }
            Moved::Intrinsic(free) if free == name => value + epsilon,
            _ => value,
        }
    };
    let mut sum = c(0.0);
    for observation in &problem.observations {
        let point = observation.point as usize;
        let at = problem.point(point).unwrap();
        let mut at = [c(at.x), c(at.y), c(at.z), c(1.0)];
        if let Moved::Point(index, axis) = moved
            && index == point
        {
            at[axis] = at[axis] + epsilon;
        }
        let [x, y, z, _] = poses[observation.view as usize].apply(at);
        let losses = &problem.losses;
        sum = sum
            + match &observation.measurement {
                Measurement::Pixel { pixel, root } => {
                    let [u, v] = project(camera.model_name(), &parameter, [x, y, z]);
                    let r = [u - c(pixel.x), v - c(pixel.y)];
                    rho(losses.pixel, squared(root, r))
                }
                Measurement::Point { point, root } => {
                    let r = [x - c(point.x), y - c(point.y), z - c(point.z)];
                    rho(losses.point, squared(root, r))
                }
                Measurement::InverseRange { inv_range, root } => {
                    let range = (x * x + y * y + z * z).sqrt();
                    let r = c(*root) * (c(1.0) / range - c(*inv_range));
                    rho(losses.inverse_range, r * r)
                }
                other => panic!("{other:?} is compared with differences"),
            };
    }
    for prior in &problem.priors {
        let (known, root) = prior.of_one_pose();
        let error = tangent(&poses[prior.views[0]].times(&matrix(&known, 1.0)));
        for row in 0..root.nrows() {
            let r = (0..6).fold(c(0.0), |sum, k| sum + c(root[(row, k)]) * error[k]);
            sum = sum + r * r;
        }
    }
    sum * c(0.5)
}

fn check(problem: &BundleProblem, free: &[&str], relative: f64) {
    let mut adjuster = BundleAdjuster::new(problem.clone(), LinearSolver::Dense);
    let value = adjuster.solve_nothing();
    adjuster.linearise(Damping::Identity, 1.0);
    let analytic = adjuster.assembly.gradient.clone();
    let scale = analytic.iter().fold(1.0, |most: f64, g| most.max(g.abs()));
    let name = problem.camera(0).unwrap().model_name();
    let close = |found: f64, moved: Moved| {
        let dual = cost(problem, moved);
        assert!((dual.v - value).abs() < RELATIVE * value, "{name}: cost");
        let error = (dual.d - found).abs();
        let bound = match moved {
            Moved::Intrinsic(_) => relative,
            _ => RELATIVE,
        };
        assert!(error < bound * scale, "{name}: {moved:?} {error:e}");
    };
    for pose in 0..problem.poses() {
        for axis in 0..6 {
            close(analytic[6 * pose + axis], Moved::Pose(pose, axis));
        }
    }
    for (k, name) in free.iter().enumerate() {
        let found = analytic[6 * problem.poses() + k];
        close(found, Moved::Intrinsic(name));
    }
    for point in 0..problem.points() {
        let gradient = adjuster.layout.chunks[0].point_gradient(point);
        for axis in 0..3 {
            close(gradient[axis], Moved::Point(point, axis));
        }
    }
}

#[test]
fn gradient_equals_dual_numbers_for_every_measurement_prior_and_camera() {
    for camera in cameras() {
        check(&sample(&camera, |_| Loss::Quadratic), &[], RELATIVE);
    }
}

#[test]
fn gradient_equals_dual_numbers_for_every_loss() {
    for make in [Loss::Huber, Loss::Cauchy, |k| Loss::Tukey(4.0 * k)] {
        check(&sample(&cameras()[0], make), &[], RELATIVE);
    }
}

#[test]
fn gradient_by_free_intrinsics_equals_dual_numbers() {
    let names: [(usize, &[&str], f64); 4] = [
        (0, &["fx", "fy", "cx", "cy", "skew"], RELATIVE),
        (
            1,
            &["focal", "cx", "k1", "k2", "p1", "p2", "k3", "k4"],
            RELATIVE,
        ),
        (3, &["focal", "k1", "k2"], BY_DIFFERENCES),
        (4, &["fx", "xi", "alpha"], BY_DIFFERENCES),
    ];
    for (camera, free, relative) in names {
        let camera: &Camera = &cameras()[camera];
        let mut problem = sample(camera, Loss::Huber);
        problem.free_intrinsics(0, free).unwrap();
        check(&problem, free, relative);
    }
}
