//! Relative poses: Jacobians, losses, gauges, poses that leave.

use super::derivatives::{cameras, check, sample};
use crate::bundle::{BundleAdjuster, BundleProblem, Issue, adjust};
use crate::generate::{SceneKind, SceneSettings, scene};
use crate::{LinearSolver, Loss, Options};
use nalgebra::{Matrix6, Vector6};
use sphereflow_core::Pose;
use sphereflow_sphere::lie::se3;

/// Metres and radians: a chain of exact edges is met but for the last step's own second order.
const EXACT: f64 = 1e-9;

fn tight() -> Options {
    Options {
        max_iterations: 100,
        function_tolerance: 1e-14,
        parameter_tolerance: 1e-12,
        ..Options::default()
    }
}

fn information() -> Matrix6<f64> {
    let a = Matrix6::from_fn(|r, c| (1.0 + r as f64 * 1.3 + c as f64 * 0.7).sin());
    a * a.transpose() + Matrix6::identity()
}

#[test]
fn gradient_of_relative_poses_equals_differences_for_every_loss() {
    for loss in [Loss::Quadratic, Loss::Huber(0.7), Loss::Cauchy(0.9)] {
        let mut problem = sample(&cameras()[0], |_| Loss::Quadratic);
        let a_from_b = problem.pose(0).unwrap().inverse() * problem.pose(1).unwrap();
        let measured = a_from_b * se3::exp(&Vector6::new(0.2, -0.3, 0.1, 0.2, 0.4, -0.3));
        for (ends, measured) in [((0, 1), measured), ((1, 0), measured.inverse())] {
            problem
                .add_relative_pose(ends, &measured, &information(), loss)
                .unwrap();
        }
        check(problem, &format!("{loss:?}"));
    }
}

/// Poses without points, tied in a ring of exact edges, and one wrong edge.
fn ring(loss: Loss, wrong: bool) -> (BundleProblem, Vec<Pose>) {
    let step = Vector6::new(0.02, 0.6, -0.05, 0.4, 0.1, 0.3);
    let truth: Vec<Pose> = (0..8).map(|k| se3::exp(&(step * f64::from(k)))).collect();
    let mut problem = BundleProblem::new();
    problem.add_camera(cameras()[0].clone());
    for (k, pose) in truth.iter().enumerate() {
        let off = Vector6::from_fn(|r, _| 0.05 * (k as f64 + 2.0 * r as f64).sin());
        let start = if k == 0 {
            *pose
        } else {
            *pose * se3::exp(&off)
        };
        problem.add_pose(start, 0).unwrap();
    }
    problem.fix_pose(0).unwrap();
    for k in 0..16 {
        let (a, b) = (k % 8, (k + 1 + k / 8) % 8);
        let bad = if wrong && k == 11 { 0.4 } else { 0.0 };
        let measured = se3::exp(&Vector6::repeat(bad)) * (truth[a].inverse() * truth[b]);
        problem
            .add_relative_pose((a, b), &measured, &(information() * 1e4), loss)
            .unwrap();
    }
    (problem, truth)
}

fn worst(problem: &BundleProblem, truth: &[Pose]) -> f64 {
    let gaps = truth.iter().enumerate().map(|(k, pose)| {
        let (distance, angle) = problem.pose(k).unwrap().distance_and_angle(pose);
        distance.max(angle)
    });
    gaps.fold(0.0, f64::max)
}

#[test]
fn poses_without_points_follow_their_relative_poses() {
    let (mut problem, truth) = ring(Loss::Quadratic, false);
    let summary = adjust(&mut problem, LinearSolver::Auto, &tight()).unwrap();
    assert_eq!(summary.issues, []);
    let error = worst(&problem, &truth);
    assert!(error < EXACT, "{error:e}");
}

#[test]
fn wrong_relative_pose_pulls_little_under_cauchy() {
    let error = |loss| {
        let (mut problem, truth) = ring(loss, true);
        adjust(&mut problem, LinearSolver::Auto, &tight()).unwrap();
        worst(&problem, &truth)
    };
    let (robust, quadratic) = (error(Loss::Cauchy(2.5)), error(Loss::Quadratic));
    println!("{robust:e} {quadratic:e}");
    // a residual of 40 sigma under Cauchy's 2.5 pulls like one of 2.5 / 16
    assert!(robust < 0.01 * quadratic);
}

#[test]
fn relative_poses_tie_groups_and_give_them_a_scale() {
    let settings = SceneSettings::new(SceneKind::Room, 12, 400, 7);
    let mut problem = scene(&settings).unwrap().problem;
    for view in &mut problem.views {
        view.fixed = false;
    }
    problem.fix_pose(0).unwrap();
    let free = |problem: &BundleProblem| {
        let adjuster = BundleAdjuster::new(problem.clone(), LinearSolver::Auto);
        adjuster.issues().to_vec()
    };
    let scale = Issue::FreeGauge {
        pose: 0,
        directions: 1,
    };
    assert_eq!(free(&problem), [scale]);
    let measured = problem.pose(0).unwrap().inverse() * problem.pose(1).unwrap();
    problem
        .add_relative_pose((0, 1), &measured, &information(), Loss::Quadratic)
        .unwrap();
    assert_eq!(free(&problem), []);
}

#[test]
fn poses_that_leave_with_their_relative_poses_leave_the_minimum_unchanged() {
    let (mut problem, _) = ring(Loss::Quadratic, true);
    adjust(&mut problem, LinearSolver::Auto, &tight()).unwrap();
    let before: Vec<Pose> = (0..8).map(|k| problem.pose(k).unwrap()).collect();
    problem.marginalise(&[2, 3]).unwrap();
    assert!(problem.relative.len() < 16);
    let off = se3::exp(&Vector6::repeat(1e-3));
    problem.set_pose(4, before[4] * off).unwrap();
    adjust(&mut problem, LinearSolver::Auto, &tight()).unwrap();
    let error = worst(&problem, &before);
    // the prior is the problem's second order at the minimum, residuals of 40 sigma and all
    assert!(error < 1e-6, "{error:e}");
}

#[test]
fn bad_relative_poses_are_errors_by_name() {
    let (mut problem, truth) = ring(Loss::Quadratic, false);
    let (good, pose) = (information(), truth[1]);
    let nan = Pose::new(Default::default(), nalgebra::Vector3::repeat(f64::NAN));
    let mut lopsided = good;
    lopsided[(0, 1)] += 0.1;
    let quadratic = Loss::Quadratic;
    for (name, found) in [
        (
            "a",
            problem.add_relative_pose((9, 1), &pose, &good, quadratic),
        ),
        (
            "b",
            problem.add_relative_pose((1, 1), &pose, &good, quadratic),
        ),
        (
            "a_from_b",
            problem.add_relative_pose((0, 1), &nan, &good, quadratic),
        ),
        (
            "information",
            problem.add_relative_pose((0, 1), &pose, &-good, quadratic),
        ),
        (
            "information",
            problem.add_relative_pose((0, 1), &pose, &lopsided, quadratic),
        ),
        (
            "loss",
            problem.add_relative_pose((0, 1), &pose, &good, Loss::Cauchy(0.0)),
        ),
    ] {
        let text = found.unwrap_err().to_string();
        assert!(text.starts_with(name), "{name}: {text}");
    }
}
