//! What a problem can be wrong with: errors by name, or issues in the result, never a NaN state.

use crate::bundle::{BundleAdjuster, BundleProblem, Issue, adjust};
use crate::generate::{SceneKind, SceneSettings, scene};
use crate::{LinearSolver, Options, StopFlag, StopReason};
use nalgebra::{Matrix2, Matrix3, Matrix6, Vector2, Vector3};
use sphereflow_core::Pose;
use sphereflow_sphere::Camera;
use std::time::Duration;

fn problem() -> BundleProblem {
    scene(&SceneSettings::new(SceneKind::Street, 8, 200, 11))
        .unwrap()
        .problem
}

fn finite(problem: &BundleProblem) -> bool {
    let poses = (0..problem.poses()).filter_map(|k| problem.pose(k));
    let points = (0..problem.points()).filter_map(|k| problem.point(k));
    poses.map(|pose| pose.matrix().sum()).all(f64::is_finite)
        && points.map(|point| point.sum()).all(f64::is_finite)
}

fn solve(problem: &mut BundleProblem) -> Vec<Issue> {
    let summary = adjust(problem, LinearSolver::Auto, &Options::default()).unwrap();
    assert!(finite(problem) && summary.final_cost <= summary.initial_cost);
    summary.issues
}

#[test]
fn point_behind_a_camera_is_left_out_by_name() {
    let mut problem = problem();
    let behind = problem
        .pose(3)
        .unwrap()
        .transform(&Vector3::new(0.0, 0.0, -2.0));
    let point = problem.add_point(behind).unwrap();
    let pixel = Vector2::new(320.0, 240.0);
    let first = problem
        .add_pixel(3, point, pixel, &Matrix2::identity())
        .unwrap();
    let issues = solve(&mut problem);
    let left_out = Issue::NotSeen {
        observation: first,
        pose: 3,
        point,
    };
    assert!(issues.contains(&left_out), "{issues:?}");
    assert!(issues.contains(&Issue::PointUndetermined { point, views: 0 }));
    assert_eq!(problem.point(point), Some(behind));
}

#[test]
fn point_seen_once_is_left_alone_by_name() {
    let mut problem = problem();
    let at = problem
        .pose(3)
        .unwrap()
        .transform(&Vector3::new(0.1, 0.0, 2.0));
    let point = problem.add_point(at).unwrap();
    problem
        .add_pixel(3, point, Vector2::new(320.0, 240.0), &Matrix2::identity())
        .unwrap();
    assert_eq!(
        solve(&mut problem),
        [Issue::PointUndetermined { point, views: 1 }]
    );
    assert_eq!(problem.point(point), Some(at));
}

#[test]
fn cameras_without_a_common_point_are_named() {
    let mut problem = problem();
    let poses = problem.poses();
    let camera = problem.camera(0).unwrap().clone();
    for k in 0..2 {
        let pose = Pose::new(
            Default::default(),
            Vector3::new(0.3 * f64::from(k), 0.0, 0.0),
        );
        let pose = problem.add_pose(pose, 0).unwrap();
        for j in 0..8 {
            let j = f64::from(j);
            let at = Vector3::new((j * 1.3).sin(), (j * 2.1).cos(), 3.0 + 0.2 * j);
            if k == 0 {
                problem.add_point(at).unwrap();
            }
            let x = problem.pose(pose).unwrap().inverse().transform(&at);
            let pixel = camera.project(&x).unwrap();
            let point = 200 + j as usize;
            problem
                .add_pixel(pose, point, pixel, &Matrix2::identity())
                .unwrap();
        }
    }
    let expected = [
        Issue::Disconnected { groups: 2 },
        Issue::FreeGauge {
            pose: poses,
            directions: 7,
        },
    ];
    assert_eq!(solve(&mut problem), expected);
    let mut adjuster = BundleAdjuster::new(problem, LinearSolver::Auto);
    assert!(
        adjuster
            .covariance(&[4])
            .unwrap_err()
            .to_string()
            .contains("move as a whole")
    );
}

#[test]
fn free_gauge_is_named_and_the_minimum_is_found_all_the_same() {
    let mut free = problem();
    for view in &mut free.views {
        view.fixed = false;
    }
    assert_eq!(
        solve(&mut free),
        [Issue::FreeGauge {
            pose: 0,
            directions: 7
        }]
    );
    let mut scale = problem();
    scale.views[1].fixed = false;
    assert_eq!(
        solve(&mut scale),
        [Issue::FreeGauge {
            pose: 0,
            directions: 1
        }]
    );
}

#[test]
fn pose_without_measurement_is_named_and_stays() {
    let mut problem = problem();
    let pose = problem.add_pose(Pose::identity(), 0).unwrap();
    assert_eq!(solve(&mut problem), [Issue::PoseUndetermined { pose }]);
    assert_eq!(problem.pose(pose), Some(Pose::identity()));
}

#[test]
fn numbers_that_are_not_finite_and_matrices_that_are_no_covariance_are_errors_by_name() {
    let mut problem = problem();
    let nan = Vector3::new(f64::NAN, 0.0, 0.0);
    let indefinite = Matrix2::new(1.0, 2.0, 2.0, 1.0);
    let lopsided = Matrix2::new(1.0, 0.5, 0.0, 1.0);
    let one = Matrix2::identity();
    let pixel = Vector2::new(1.0, 2.0);
    let pose = Pose::identity();
    for (name, error) in [
        ("pixel", problem.add_pixel(0, 0, nan.xy(), &one).err()),
        (
            "covariance",
            problem.add_pixel(0, 0, pixel, &indefinite).err(),
        ),
        (
            "covariance",
            problem.add_pixel(0, 0, pixel, &lopsided).err(),
        ),
        (
            "covariance",
            problem.add_pixel(0, 0, pixel, &(one * f64::NAN)).err(),
        ),
        ("pose", problem.add_pixel(8, 0, pixel, &one).err()),
        ("point", problem.add_pixel(0, 200, pixel, &one).err()),
        (
            "point_in_camera",
            problem
                .add_point_measurement(0, 0, nan, &Matrix3::identity())
                .err(),
        ),
        (
            "inv_range",
            problem.add_inverse_range(0, 0, -1.0, 0.1).err(),
        ),
        (
            "sigma",
            problem.add_inverse_range(0, 0, 1.0, f64::NAN).err(),
        ),
        (
            "covariance",
            problem.add_pose_prior(0, &pose, &Matrix6::zeros()).err(),
        ),
        ("position", problem.add_point(nan).err()),
        (
            "world_from_camera",
            problem.add_pose(Pose::new(pose.rotation, nan), 0).err(),
        ),
        ("camera", problem.add_pose(pose, 1).err()),
    ] {
        let text = error.map(|e| e.to_string()).unwrap_or_default();
        assert!(text.starts_with(name), "{name}: {text}");
    }
}

#[test]
fn raised_flag_and_spent_budget_end_the_iterations() {
    let mut first = problem();
    let stop = StopFlag::new();
    stop.raise();
    let options = Options {
        stop,
        ..Options::default()
    };
    let summary = adjust(&mut first, LinearSolver::Auto, &options).unwrap();
    assert_eq!(summary.stop, StopReason::Interrupted);
    let time_budget = Some(Duration::ZERO);
    let options = Options {
        time_budget,
        ..Options::default()
    };
    let summary = adjust(&mut first, LinearSolver::Auto, &options).unwrap();
    assert_eq!(summary.stop, StopReason::TimeBudget);
}

#[test]
fn problem_in_which_nothing_moves_says_so() {
    let mut problem = BundleProblem::new();
    problem.add_camera(Camera::pinhole(300.0, 300.0, 160.0, 120.0, 320, 240).unwrap());
    let summary = adjust(&mut problem, LinearSolver::Auto, &Options::default()).unwrap();
    assert_eq!(summary.stop, StopReason::NothingToDo);
}
