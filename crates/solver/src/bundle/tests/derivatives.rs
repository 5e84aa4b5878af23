//! Every Jacobian against differences, through the normal equations they make.

use crate::bundle::ids::NONE;
use crate::bundle::intrinsics::Intrinsics;
use crate::bundle::measurement::{Losses, Measurement};
use crate::bundle::normal::{Curvature, Normal};
use crate::bundle::rows::{CameraState, STILL};
use crate::bundle::{BundleAdjuster, BundleProblem};
use crate::minimise::System;
use crate::{Damping, LinearSolver, Loss};
use nalgebra::{Matrix2, Matrix3, Matrix6, UnitQuaternion, Vector2, Vector3, Vector6};
use sphereflow_core::Pose;
use sphereflow_sphere::Camera;
use sphereflow_sphere::lie::{se3, so3};

/// Step of central differences of a cost of size 10 with third derivatives of size 1e3: truncation
/// 1e3 * 1e-10, rounding 1e-15 * 10 / 1e-5.
const STEP: f64 = 1e-5;
const RELATIVE: f64 = 1e-5;

pub(super) fn cameras() -> Vec<Camera> {
    vec![
        Camera::pinhole_with_skew(400.0, 410.0, 320.0, 240.0, 1.5, 640, 480).unwrap(),
        Camera::opencv(
            400.0,
            410.0,
            320.0,
            240.0,
            [-0.1, 0.02, 1e-3, -2e-3, 0.01, 0.0, 0.0, 0.0],
            640,
            480,
        )
        .unwrap(),
        Camera::fov(400.0, 410.0, 320.0, 240.0, 0.9, 640, 480).unwrap(),
        Camera::kannala_brandt(400.0, 410.0, 320.0, 240.0, [0.02, 0.01, 0.0, 0.0], 640, 480)
            .unwrap(),
        Camera::double_sphere(400.0, 410.0, 320.0, 240.0, [0.1, 0.55], 640, 480).unwrap(),
        Camera::equirectangular(800, 400).unwrap(),
    ]
}

fn spd3(seed: f64) -> Matrix3<f64> {
    let a = Matrix3::from_fn(|r, c| (seed + r as f64 * 1.3 + c as f64 * 0.7).sin());
    a * a.transpose() + Matrix3::identity()
}

/// Two poses and three points with every kind of measurement and prior, away from the minimum.
pub(super) fn sample(camera: &Camera, loss: impl Fn(f64) -> Loss) -> BundleProblem {
    let mut problem = BundleProblem::new();
    problem.add_camera(camera.clone());
    let start = |k: f64| {
        let turn = UnitQuaternion::from_euler_angles(0.1 * k, -0.2 + 0.1 * k, 0.3);
        Pose::new(turn, Vector3::new(0.3 * k, -0.1, 0.05 * k))
    };
    for k in 0..2 {
        let pose = start(f64::from(k));
        problem.add_pose(pose, 0).unwrap();
        let known = pose * se3::exp(&Vector6::new(0.1, -0.2, 0.15, 0.3, 0.1, -0.2));
        let covariance = Matrix6::identity() * 0.5 + Matrix6::repeat(0.05);
        problem
            .add_pose_prior(k as usize, &known, &covariance)
            .unwrap();
        let turned = known.rotation * so3::exp(&Vector3::new(0.05, 0.1, 0.0));
        problem
            .add_attitude_prior(k as usize, &turned, &spd3(2.0))
            .unwrap();
    }
    for k in 0..3 {
        let at = start(0.5).transform(&Vector3::new(0.4 * f64::from(k) - 0.5, 0.2, 2.0));
        let point = problem.add_point(at).unwrap();
        for view in 0..2 {
            let x = problem.pose(view).unwrap().inverse().transform(&at);
            let pixel = camera.project(&x).unwrap() + Vector2::new(1.5, -2.0);
            let spread = Matrix2::new(4.0, 0.6, 0.6, 3.0);
            problem.add_pixel(view, point, pixel, &spread).unwrap();
            let seen = x + Vector3::new(0.6, -0.3, 0.7);
            problem
                .add_point_measurement(view, point, seen, &spd3(1.0))
                .unwrap();
            problem
                .add_inverse_range(view, point, 1.2 / x.norm(), 0.05)
                .unwrap();
        }
    }
    problem.losses.pixel = loss(0.8);
    problem.losses.point = loss(0.3);
    problem.losses.inverse_range = loss(1.1);
    problem
}

/// The cost with one entry of the reduced step at `h` and everything else where it is.
fn moved(adjuster: &mut BundleAdjuster, entry: usize, h: f64) -> f64 {
    adjuster.assembly.step.fill(0.0);
    adjuster.assembly.step[entry] = h;
    assert!(adjuster.move_blocks());
    for chunk in &mut adjuster.layout.chunks {
        chunk.candidate.clone_from(&chunk.current);
    }
    candidate_as_it_is(adjuster)
}

/// The cost of the candidate; asked for as a candidate, points under robust losses would move.
fn candidate_as_it_is(adjuster: &mut BundleAdjuster) -> f64 {
    adjuster.accept();
    let cost = adjuster.cost().unwrap();
    adjuster.accept();
    cost
}

pub(super) fn check(problem: BundleProblem, name: &str) {
    let points = problem.points();
    let mut adjuster = BundleAdjuster::new(problem, LinearSolver::Dense);
    adjuster.load();
    adjuster.linearise(Damping::Identity, 1.0);
    let analytic = adjuster.assembly.gradient.clone();
    let scale = analytic.iter().fold(1.0, |most: f64, g| most.max(g.abs()));
    for (entry, analytic) in analytic.iter().enumerate() {
        let up = moved(&mut adjuster, entry, STEP);
        let down = moved(&mut adjuster, entry, -STEP);
        let numeric = (up - down) / (2.0 * STEP);
        assert!(
            (numeric - analytic).abs() < RELATIVE * scale,
            "{name}: {entry}"
        );
    }
    adjuster.assembly.step.fill(0.0);
    assert!(adjuster.move_blocks());
    for point in 0..points {
        for axis in 0..3 {
            let mut cost = |h: f64| {
                let chunk = &mut adjuster.layout.chunks[0];
                chunk.candidate.clone_from(&chunk.current);
                chunk.candidate[point][axis] += h;
                candidate_as_it_is(&mut adjuster)
            };
            let numeric = (cost(STEP) - cost(-STEP)) / (2.0 * STEP);
            let analytic = adjuster.layout.chunks[0].point_gradient(point)[axis];
            let scale = scale.max(analytic.abs());
            assert!(
                (numeric - analytic).abs() < RELATIVE * scale,
                "{name}: {point} {axis}"
            );
        }
    }
}

#[test]
fn gradient_of_every_measurement_equals_differences_for_every_camera() {
    // Thesis: eq. (8.2). Thesis: eq. (9.1). Thesis: section 9.3.2.
    for camera in cameras() {
        check(sample(&camera, |_| Loss::Quadratic), camera.model_name());
    }
}

#[test]
fn gradient_of_every_loss_equals_differences() {
    let camera = &cameras()[0];
    let losses: [fn(f64) -> Loss; 3] = [Loss::Huber, Loss::Cauchy, |k| Loss::Tukey(20.0 * k)];
    for (k, loss) in losses.into_iter().enumerate() {
        check(sample(camera, loss), &format!("loss {k}"));
    }
}

#[test]
fn gradient_by_free_intrinsics_equals_differences() {
    for (camera, names) in [
        (0, &["fx", "fy", "cx", "cy", "skew"][..]),
        (1, &["focal", "k1", "k2", "p1", "p2", "k3"]),
        (2, &["fx", "w"]),
        (3, &["cx", "k1", "k2"]),
        (4, &["xi", "alpha"]),
    ] {
        let mut problem = sample(&cameras()[camera], |_| Loss::Quadratic);
        problem.free_intrinsics(0, names).unwrap();
        check(problem, names[0]);
    }
}

#[test]
fn normal_matrix_equals_that_of_differences() {
    // without priors, whose Jacobians the gradients test
    let mut problem = sample(&cameras()[1], |_| Loss::Quadratic);
    problem.priors.clear();
    problem.free_intrinsics(0, &["focal", "cx", "k1"]).unwrap();
    assert_eq!(normal_matrix(problem), 2 * 36 + 9 + 2 * 18);
}

/// Compares the normal matrix of poses and intrinsics with that of differences of the residuals;
/// the number of entries.
pub(super) fn normal_matrix(problem: BundleProblem) -> usize {
    let mut adjuster = BundleAdjuster::new(problem, LinearSolver::Dense);
    adjuster.load();
    adjuster.linearise(Damping::Identity, 1e300); // points that cannot move
    adjuster
        .assembly
        .reduce(&adjuster.layout, Damping::Identity, 1e300);
    let n = adjuster.layout.pattern.dimension();
    let mut residuals = |entry: usize, h: f64| {
        adjuster.assembly.step.fill(0.0);
        adjuster.assembly.step[entry] = h;
        assert!(adjuster.move_blocks());
        adjuster.accept_blocks();
        let all = adjuster.whitened();
        adjuster.accept_blocks();
        all
    };
    let columns: Vec<_> = (0..n)
        .map(|k| (residuals(k, STEP) - residuals(k, -STEP)) / (2.0 * STEP))
        .collect();
    let (pattern, direct) = (&adjuster.layout.pattern, &adjuster.layout.direct);
    let mut compared = 0;
    for &(from, to, _) in &direct.targets {
        let (row, column) = (0..pattern.blocks())
            .flat_map(|c| pattern.column(c).map(move |(r, o)| (r, c, o)))
            .find(|&(_, _, offset)| offset == to)
            .map(|(r, c, _)| (r, c))
            .unwrap();
        for c in 0..pattern.size(column) {
            for r in 0..pattern.size(row) {
                let (i, j) = (pattern.start(row) + r, pattern.start(column) + c);
                let numeric = columns[i].dot(&columns[j]);
                let analytic = adjuster.assembly.direct[from + c * pattern.size(row) + r];
                let scale = columns[i].norm() * columns[j].norm();
                assert!((numeric - analytic).abs() < 1e-6 * (1.0 + scale), "{i} {j}");
                compared += 1;
            }
        }
    }
    assert!(direct.cross.iter().all(|&offset| offset != NONE));
    compared
}

#[test]
fn curvature_of_a_robust_cost_equals_its_second_differences() {
    // Thesis: section 8.4.2: a residual that is linear in the point, so that the loss alone bends
    let root = spd3(1.0).cholesky().unwrap().l().transpose();
    let point = Vector3::new(0.2, -0.1, 2.0);
    let measurement = Measurement::Point { point, root };
    let intrinsics = &Intrinsics::fixed(cameras()[0].clone());
    let camera = CameraState {
        intrinsics,
        rows: &STILL,
    };
    let x = point + Vector3::new(0.3, 0.4, -0.2);
    // inside the inflection, where the curvature along the residual is not bounded
    for loss in [Loss::Huber(3.0), Loss::Cauchy(3.0), Loss::Tukey(5.0)] {
        let losses = Losses {
            point: loss,
            ..Losses::default()
        };
        let mut normal = Normal::new();
        assert!(measurement.add(camera, &x, &losses, Curvature::Own, &mut normal));
        let cost = |x: &Vector3<f64>| {
            let squared = measurement.squared(camera, x).unwrap();
            0.5 * loss.evaluate(squared).0
        };
        let h = 1e-4;
        let unit = |axis: usize| Vector3::from_fn(|r, _| if r == axis { h } else { 0.0 });
        let numeric = Matrix3::from_fn(|r, c| {
            let (a, b) = (unit(r), unit(c));
            let pair = cost(&(x + a + b)) - cost(&(x + a - b)) - cost(&(x - a + b));
            (pair + cost(&(x - a - b))) / (4.0 * h * h)
        });
        // rounding 1e-16 / 1e-8, truncation of the square of the step
        assert!((numeric - normal.m).norm() < 1e-6, "{loss:?}");
        let mut above = Normal::new();
        measurement.add(camera, &x, &losses, Curvature::Above, &mut above);
        let gap = (above.m - normal.m).symmetric_eigenvalues();
        assert!(
            gap.min() > -1e-12,
            "{loss:?}: the reweighted quadratic lies above"
        );
    }
}
