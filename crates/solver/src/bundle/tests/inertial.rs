//! IMU samples, pixels and priors in one adjustment.

use super::derivatives::{cameras, check, sample};
use crate::bundle::{BundleAdjuster, BundleProblem, Issue, Motion};
use crate::generate::Random;
use crate::inertial::tests::{GRAVITY, bias, integrate, shift, state};
use crate::inertial::{ImuBias, InertialState};
use crate::{LinearSolver, Loss, Options};
use nalgebra::{Matrix2, UnitQuaternion, Vector2, Vector3};
use sphereflow_core::Pose;
use sphereflow_sphere::Camera;
use sphereflow_sphere::lie::se3;

fn body_from_camera() -> Pose {
    let turn = UnitQuaternion::from_euler_angles(0.2, -0.4, 1.3);
    Pose::new(turn, Vector3::new(0.05, -0.1, 0.08))
}

#[test]
fn gradient_of_inertial_terms_equals_differences() {
    let mut problem = sample(&cameras()[0], |_| Loss::Quadratic);
    problem.set_imu(GRAVITY, body_from_camera()).unwrap();
    for pose in 0..2 {
        let off = shift(pose as f64);
        let motion = Motion {
            velocity: Vector3::new(off[6], off[7], off[8]) * 5.0,
            bias: bias(),
        };
        problem.add_motion(pose, motion).unwrap();
    }
    // noisier than the others, so that no term drowns the rest
    let samples = integrate(0.2, 0.6, &bias(), ImuBias::default());
    problem.add_imu(0, 1, samples).unwrap();
    problem
        .add_bias_prior(1, ImuBias::default(), (0.01, 0.1))
        .unwrap();
    check(problem, "inertial");
}

/// Nine poses of a smooth motion, seen by one camera without scale; the start is off, and a fifth too
/// large.
fn window(imu: bool) -> BundleProblem {
    let camera = Camera::equirectangular(1024, 512).unwrap();
    let mut random = Random::new(3);
    let mut problem = BundleProblem::new();
    problem.add_camera(camera.clone());
    problem.set_imu(GRAVITY, body_from_camera()).unwrap();
    let times: Vec<f64> = (0..9).map(|k| 0.3 * f64::from(k)).collect();
    let truth: Vec<Pose> = times
        .iter()
        .map(|&t| state(t).pose * body_from_camera())
        .collect();
    for (k, pose) in truth.iter().enumerate() {
        let noise = if k == 0 { 0.0 } else { 0.02 };
        let mut start = *pose * se3::exp(&random.normal::<6>(noise));
        start.translation += (start.translation - truth[0].translation) * 0.2;
        problem.add_pose(start, 0).unwrap();
        if imu {
            problem.add_motion(k, Motion::default()).unwrap();
        }
    }
    problem.fix_pose(0).unwrap();
    for _ in 0..150 {
        let at = random.normal::<3>(1.0).normalize() * random.between(2.0, 6.0);
        let start = at + (at - truth[0].translation) * 0.2 + random.normal::<3>(0.05);
        let point = problem.add_point(start).unwrap();
        for (k, pose) in truth.iter().enumerate() {
            let pixel = camera.project(&pose.inverse().transform(&at)).unwrap();
            // the image ends where it begins: a pixel there could come back on the other side
            if (pixel.x - 512.0).abs() > 480.0 {
                continue;
            }
            let noisy: Vector2<f64> = pixel + random.normal::<2>(0.3);
            let covariance = Matrix2::identity() * 0.09;
            problem.add_pixel(k, point, noisy, &covariance).unwrap();
        }
    }
    if imu {
        for k in 1..times.len() {
            let samples = integrate(times[k - 1], times[k], &bias(), ImuBias::default());
            problem.add_imu(k - 1, k, samples).unwrap();
        }
        problem
            .add_bias_prior(0, ImuBias::default(), (0.1, 1.0))
            .unwrap();
    }
    problem
}

fn error(problem: &BundleProblem) -> f64 {
    let gap = |k: usize| {
        let truth = state(0.3 * k as f64).pose * body_from_camera();
        problem.pose(k).unwrap().distance_and_angle(&truth).0
    };
    (0..9).map(gap).fold(0.0, f64::max)
}

#[test]
fn pixels_and_samples_together_find_scale_velocities_and_biases() {
    let options = Options {
        function_tolerance: 1e-12,
        ..Options::default()
    };
    let mut tight = BundleAdjuster::new(window(true), LinearSolver::Auto);
    let with = tight.solve(&options).unwrap();
    assert_eq!(with.issues, []);
    let covariance = tight.covariance(&[8]).unwrap();
    let sigma = covariance.view((3, 3), (3, 3)).trace().sqrt();
    let tight = tight.into_problem();
    let mut loose = BundleAdjuster::new(window(false), LinearSolver::Auto);
    let without = loose.solve(&options).unwrap();
    assert!(matches!(
        without.issues[..],
        [Issue::FreeGauge { directions: 1, .. }]
    ));
    let (tight_error, loose_error) = (error(&tight), error(loose.problem()));
    println!("{} steps, {:?}", with.iterations.len(), with.stop);
    println!(
        "worst centre: {tight_error:.5} m with samples (sigma {sigma:.5} m), {loose_error:.5} m without"
    );
    // without samples the scale stays as far off as the start
    assert!(tight_error < 3.0 * sigma && sigma < 0.03 && loose_error > 0.2);
    for k in 0..9 {
        let (found, truth): (Motion, InertialState) =
            (tight.motion(k).unwrap(), state(0.3 * k as f64));
        let off = (found.velocity - truth.velocity).norm();
        assert!(off < 3e-2, "{k} {off}");
        assert!((found.bias.gyro - bias().gyro).norm() < 2e-3, "{k}");
        assert!((found.bias.accel - bias().accel).norm() < 5e-2, "{k}");
    }
}

#[test]
fn bad_inertial_arguments_are_errors_by_name() {
    let mut problem = window(true);
    let samples = integrate(0.0, 0.1, &bias(), bias());
    let nan = Vector3::repeat(f64::NAN);
    let still = Motion {
        velocity: nan,
        ..Motion::default()
    };
    let none = crate::inertial::Preintegration::new(bias(), *samples.sigmas());
    for (name, error) in [
        ("gravity", problem.set_imu(nan, Pose::identity()).err()),
        ("pose", problem.add_motion(99, Motion::default()).err()),
        ("pose", problem.add_motion(0, Motion::default()).err()),
        ("to", problem.add_imu(0, 99, samples.clone()).err()),
        ("to", problem.add_imu(0, 0, samples.clone()).err()),
        ("samples", problem.add_imu(0, 1, none.unwrap()).err()),
        (
            "gyro_sigma",
            problem.add_bias_prior(0, bias(), (0.0, 1.0)).err(),
        ),
        ("poses", problem.marginalise(&[99]).err()),
        (
            "velocity",
            BundleProblem::clone(&window(false))
                .add_motion(1, still)
                .err(),
        ),
    ] {
        let text = error.map(|e| e.to_string()).unwrap_or_default();
        assert!(text.starts_with(name), "{name}: {text}");
    }
}
