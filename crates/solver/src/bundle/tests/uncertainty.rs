//! Covariances against Monte Carlo, and marginalised poses.

use crate::bundle::{BundleAdjuster, adjust};
use crate::generate::{Scene, SceneKind, SceneSettings, scene};
use crate::{LinearSolver, Options};
use nalgebra::{Matrix6, Vector6};
use sphereflow_sphere::lie::se3;

const RUNS: u64 = 300;
/// A standard deviation from 300 samples is good to 1 / sqrt(600) = 4 %; four of those.
const MONTE_CARLO: f64 = 0.16;

fn tight() -> Options {
    Options {
        max_iterations: 60,
        function_tolerance: 1e-14,
        parameter_tolerance: 1e-13,
        ..Options::default()
    }
}

fn sample(run: u64) -> Scene {
    let mut settings = SceneSettings::new(SceneKind::Street, 5, 60, 5);
    settings.depth_sigma_m = Some(0.05);
    let mut truth = scene(&settings).unwrap();
    // the same world, measured again
    let mut noise = crate::generate::Random::new(run);
    for observation in &mut truth.problem.observations {
        let pose = &truth.true_poses[observation.view as usize];
        let x = pose
            .inverse()
            .transform(&truth.true_points[observation.point as usize]);
        let camera = truth.problem.intrinsics[0].camera.clone();
        observation.measurement.replace(
            camera.project(&x).unwrap() + noise.normal::<2>(0.5),
            x + noise.normal::<3>(0.05),
        );
    }
    truth
}

#[test]
fn covariance_equals_monte_carlo() {
    let mut sum = Matrix6::zeros();
    let mut predicted = None;
    for run in 0..RUNS {
        let truth = sample(run);
        let mut adjuster = BundleAdjuster::new(truth.problem, LinearSolver::Auto);
        adjuster.solve(&tight()).unwrap();
        let found = adjuster.problem().pose(4).unwrap();
        let error: Vector6<f64> = se3::log(&(found.inverse() * truth.true_poses[4]));
        sum += error * error.transpose();
        predicted.get_or_insert_with(|| adjuster.covariance(&[4]).unwrap());
    }
    let (predicted, found) = (predicted.unwrap(), sum / RUNS as f64);
    for axis in 0..6 {
        let ratio = (found[(axis, axis)] / predicted[(axis, axis)]).sqrt();
        println!("{axis} {ratio:.3}");
        assert!((ratio - 1.0).abs() < MONTE_CARLO, "axis {axis}: {ratio}");
    }
    // the whole matrix: the squared errors in its own metric are 6 on average, +- sqrt(12 / 300)
    let inverse = predicted.try_inverse().unwrap();
    let squared: f64 = (0..6).map(|k| inverse.row(k).dot(&found.row(k))).sum();
    assert!((squared - 6.0).abs() < 0.8, "{squared}");
}

#[test]
fn covariance_of_several_poses_is_joint_and_zero_where_fixed() {
    let mut adjuster = BundleAdjuster::new(sample(1).problem, LinearSolver::Auto);
    adjuster.solve(&tight()).unwrap();
    let joint = adjuster.covariance(&[4, 0, 2]).unwrap();
    assert_eq!(joint.view((6, 0), (6, 18)).norm(), 0.0);
    let alone = adjuster.covariance(&[2]).unwrap();
    assert!((joint.view((12, 12), (6, 6)) - &alone).norm() < 1e-12 * alone.norm());
    assert!(joint.view((0, 12), (6, 6)).norm() > 0.0);
    assert!(adjuster.covariance(&[5]).is_err());
}

#[test]
fn marginalised_poses_leave_minimum_and_covariance_unchanged() {
    let mut problem = sample(2).problem;
    adjust(&mut problem, LinearSolver::Auto, &tight()).unwrap();
    let before = problem.pose(4).unwrap();
    let mut adjuster = BundleAdjuster::new(problem.clone(), LinearSolver::Auto);
    let covariance = adjuster.covariance(&[4]).unwrap();
    problem.marginalise(&[2]).unwrap();
    assert!(problem.observations() < adjuster.problem().observations());
    let moved = problem.pose(4).unwrap() * se3::exp(&Vector6::repeat(1e-3));
    problem.set_pose(4, moved).unwrap();
    let mut adjuster = BundleAdjuster::new(problem, LinearSolver::Auto);
    let summary = adjuster.solve(&tight()).unwrap();
    assert_eq!(summary.issues, []);
    let (distance, angle) = adjuster
        .problem()
        .pose(4)
        .unwrap()
        .distance_and_angle(&before);
    println!("{distance:e} {angle:e}");
    // the prior is the problem's second order at the minimum
    assert!(distance < 1e-7 && angle < 1e-7);
    let after = adjuster.covariance(&[4]).unwrap();
    assert!((after - &covariance).norm() < 1e-6 * covariance.norm());
}
