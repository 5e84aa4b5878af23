//! Keyframes that leave with their velocities and biases, against the problem that keeps them.

use crate::bundle::{BundleAdjuster, BundleProblem, Issue, Motion};
use crate::generate::Random;
use crate::inertial::tests::{GRAVITY, SIGMAS, bias, measure, state};
use crate::inertial::{ImuBias, Preintegration};
use crate::{LinearSolver, Options};
use nalgebra::{DMatrix, Matrix2, Vector2, Vector6};
use sphereflow_core::Pose;
use sphereflow_sphere::Camera;
use sphereflow_sphere::lie::se3;

/// Keyframes, and seconds between them.
const KEYFRAMES: usize = 6;
const EVERY_S: f64 = 0.3;
/// Seconds of an IMU sample: the middle rule is good to 1e-5 m/s then, a hundredth of the noise.
const SAMPLE_S: f64 = 0.01;
const PIXEL_SIGMA: f64 = 0.3;
const RUNS: u64 = 150;

fn tight() -> Options {
    Options {
        max_iterations: 60,
        function_tolerance: 1e-15,
        parameter_tolerance: 1e-13,
        ..Options::default()
    }
}

fn noisy_samples(from: f64, random: &mut Random) -> Preintegration {
    let mut all = Preintegration::new(ImuBias::default(), SIGMAS).unwrap();
    let scale = 1.0 / SAMPLE_S.sqrt();
    for k in 0..(EVERY_S / SAMPLE_S).round() as usize {
        let (gyro, accel) = measure(from + (k as f64 + 0.5) * SAMPLE_S, &bias());
        let gyro = gyro + random.normal::<3>(SIGMAS.gyro * scale);
        let accel = accel + random.normal::<3>(SIGMAS.accel * scale);
        all.push(&gyro, &accel, SAMPLE_S).unwrap();
    }
    all
}

/// A camera and an IMU in one body; each point is seen by three keyframes that follow each other.
fn window(seed: u64) -> BundleProblem {
    let camera = Camera::equirectangular(1024, 512).unwrap();
    let mut random = Random::new(seed);
    let mut problem = BundleProblem::new();
    problem.add_camera(camera.clone());
    problem.set_imu(GRAVITY, Pose::identity()).unwrap();
    for k in 0..KEYFRAMES {
        let truth = state(EVERY_S * k as f64);
        let noise = if k == 0 { 0.0 } else { 0.01 };
        let start = truth.pose * se3::exp(&random.normal::<6>(noise));
        problem.add_pose(start, 0).unwrap();
        let motion = Motion {
            velocity: truth.velocity,
            ..Motion::default()
        };
        problem.add_motion(k, motion).unwrap();
    }
    problem.fix_pose(0).unwrap();
    // the points are the same in every run
    let mut places = Random::new(5);
    for j in 0..90 {
        let at = places.normal::<3>(1.0).normalize() * places.between(2.0, 6.0);
        let point = problem.add_point(at + random.normal::<3>(0.02)).unwrap();
        let first = j % (KEYFRAMES - 2);
        for k in first..first + 3 {
            let seen = state(EVERY_S * k as f64).pose.inverse().transform(&at);
            let pixel = camera.project(&seen).unwrap();
            // the image ends where it begins: a pixel there could come back on the other side
            if (pixel.x - 512.0).abs() > 470.0 {
                continue;
            }
            let noisy: Vector2<f64> = pixel + random.normal::<2>(PIXEL_SIGMA);
            let covariance = Matrix2::identity() * PIXEL_SIGMA * PIXEL_SIGMA;
            problem.add_pixel(k, point, noisy, &covariance).unwrap();
        }
    }
    for k in 1..KEYFRAMES {
        let samples = noisy_samples(EVERY_S * (k - 1) as f64, &mut random);
        problem.add_imu(k - 1, k, samples).unwrap();
    }
    let (gyro, accel) = (0.02, 0.1);
    let known = ImuBias {
        gyro: bias().gyro + random.normal::<3>(gyro),
        accel: bias().accel + random.normal::<3>(accel),
    };
    problem.add_bias_prior(0, known, (gyro, accel)).unwrap();
    problem
}

fn solved(problem: BundleProblem) -> BundleAdjuster {
    let mut adjuster = BundleAdjuster::new(problem, LinearSolver::Auto);
    adjuster.solve(&tight()).unwrap();
    adjuster
}

/// The largest differences of centres (m), attitudes (rad), velocities, biases of what stayed.
fn worst(found: &BundleProblem, truth: &BundleProblem, from: usize) -> [f64; 3] {
    let mut worst = [0.0_f64; 3];
    for k in from..KEYFRAMES {
        let (a, b) = (found.pose(k).unwrap(), truth.pose(k).unwrap());
        let (distance, angle) = a.distance_and_angle(&b);
        let gap = found.motion(k).unwrap().minus(&truth.motion(k).unwrap());
        for (worst, gap) in worst.iter_mut().zip([distance, angle, gap.norm()]) {
            *worst = worst.max(gap);
        }
    }
    worst
}

#[test]
fn marginalised_keyframes_with_motions_leave_minimum_and_covariance_unchanged() {
    let mut full = solved(window(1));
    let covariance = full.covariance(&[3, 5]).unwrap();
    let full = full.into_problem();
    let mut fewer = full.clone();
    fewer.marginalise(&[0, 1]).unwrap();
    assert!(fewer.observations() < full.observations());
    for k in 2..KEYFRAMES {
        let start = full.pose(k).unwrap() * se3::exp(&Vector6::repeat(3e-4));
        fewer.set_pose(k, start).unwrap();
    }
    let mut adjuster = BundleAdjuster::new(fewer, LinearSolver::Auto);
    let summary = adjuster.solve(&tight()).unwrap();
    // points that one keyframe sees alone are named; nothing floats
    let points = |issue: &Issue| matches!(issue, Issue::PointUndetermined { .. });
    assert!(summary.issues.iter().all(points), "{:?}", summary.issues);
    let after = adjuster.covariance(&[3, 5]).unwrap();
    let gaps = worst(adjuster.problem(), &full, 2);
    println!("centres, attitudes, motions off by {gaps:?}");
    // the prior is the problem's second order at the minimum, to which the others lead back
    assert!(gaps.iter().all(|gap| *gap < 1e-6), "{gaps:?}");
    assert!((&after - &covariance).norm() < 1e-6 * covariance.norm());
}

#[test]
fn keyframes_that_leave_one_by_one_leave_the_same_prior_as_together() {
    let full = solved(window(2)).into_problem();
    let (mut together, mut one_by_one) = (full.clone(), full);
    together.marginalise(&[0, 1, 2]).unwrap();
    for pose in 0..3 {
        one_by_one.marginalise(&[pose]).unwrap();
    }
    let covariance = |problem: BundleProblem| -> DMatrix<f64> {
        let mut adjuster = BundleAdjuster::new(problem, LinearSolver::Auto);
        adjuster.covariance(&[3, 4, 5]).unwrap()
    };
    let (together, one_by_one) = (covariance(together), covariance(one_by_one));
    let error = (&together - one_by_one).norm() / together.norm();
    assert!(error < 1e-6, "{error:e}");
}

#[test]
fn covariance_after_keyframes_left_equals_monte_carlo() {
    let (mut sum, mut moved) = (0.0, 0.0_f64);
    for run in 0..RUNS {
        // the window slides: the first keyframes leave before the last one is adjusted
        let mut problem = solved(window(100 + run)).into_problem();
        let before = problem.pose(KEYFRAMES - 1).unwrap();
        problem.marginalise(&[0, 1]).unwrap();
        let mut adjuster = solved(problem);
        let found = adjuster.problem().pose(KEYFRAMES - 1).unwrap();
        moved = moved.max(found.distance_and_angle(&before).0);
        let truth = state(EVERY_S * (KEYFRAMES - 1) as f64).pose;
        let error = se3::log(&(found.inverse() * truth));
        let covariance = adjuster.covariance(&[KEYFRAMES - 1]).unwrap();
        let factor = covariance.cholesky().unwrap();
        let whitened = factor.solve(&nalgebra::DVector::from_column_slice(error.as_slice()));
        sum += whitened.dot(&nalgebra::DVector::from_column_slice(error.as_slice()));
    }
    let mean = sum / RUNS as f64;
    println!("squared error in its own metric: {mean:.2} of 6; moved by {moved:e} m");
    // the mean of 150 of variance 12 is good to 0.28; four of those
    assert!((mean - 6.0).abs() < 1.13, "{mean}");
    assert!(moved < 1e-5);
}
