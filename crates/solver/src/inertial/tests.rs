//! Pre-integration against exact motion, Jacobians against differences, biases found in a window.

use super::link::moved;
use super::*;
use crate::Options;
use crate::generate::Random;
use nalgebra::{Matrix6, SVector, Vector3};
use sphereflow_core::Pose;
use sphereflow_sphere::lie::so3;

pub(crate) const GRAVITY: Vector3<f64> = Vector3::new(0.0, 9.81, 0.0);
pub(crate) const SIGMAS: ImuSigmas = ImuSigmas {
    gyro: 1e-3,
    accel: 1e-2,
    gyro_walk: 1e-5,
    accel_walk: 1e-4,
};

/// A smooth motion: attitude, position and derivatives are exact.
fn pose(t: f64) -> Pose {
    let turn = so3::exp(&(Vector3::new(0.3, -0.5, 0.2) * t))
        * so3::exp(&Vector3::new(0.0, 0.4 * (1.3 * t).sin(), 0.0));
    Pose::new(
        turn,
        Vector3::new((0.8 * t).sin(), 0.3 * (1.7 * t).cos(), 0.5 * t * t),
    )
}

fn derivative<T>(f: impl Fn(f64) -> T, t: f64) -> T
where
    T: std::ops::Sub<Output = T> + std::ops::Div<f64, Output = T>,
{
    (f(t + 1e-5) - f(t - 1e-5)) / 2e-5
}

fn velocity(t: f64) -> Vector3<f64> {
    derivative(|t| pose(t).translation, t)
}

/// What an ideal IMU measures at `t`, with biases.
pub(crate) fn measure(t: f64, bias: &ImuBias) -> (Vector3<f64>, Vector3<f64>) {
    let (a, b) = (pose(t - 1e-5).rotation, pose(t + 1e-5).rotation);
    let gyro = so3::log(&(a.inverse() * b)) / 2e-5;
    let f = |t: f64| pose(t).translation;
    let acceleration = (f(t + 1e-3) - f(t) * 2.0 + f(t - 1e-3)) / 1e-6;
    let force = pose(t).rotation.inverse() * (acceleration - GRAVITY);
    (gyro + bias.gyro, force + bias.accel)
}

pub(crate) fn integrate(from: f64, to: f64, truth: &ImuBias, guess: ImuBias) -> Preintegration {
    let mut all = Preintegration::new(guess, SIGMAS).unwrap();
    let steps = ((to - from) * 1000.0).round() as usize;
    for k in 0..steps {
        let (gyro, accel) = measure(from + (k as f64 + 0.5) * 1e-3, truth);
        all.push(&gyro, &accel, 1e-3).unwrap();
    }
    all
}

pub(crate) fn bias() -> ImuBias {
    ImuBias {
        gyro: Vector3::new(0.01, -0.02, 0.015),
        accel: Vector3::new(0.05, 0.1, -0.08),
    }
}

pub(crate) fn state(t: f64) -> InertialState {
    InertialState {
        pose: pose(t),
        velocity: velocity(t),
        bias: bias(),
    }
}

#[test]
fn preintegration_of_exact_samples_follows_the_motion() {
    let mut window = InertialWindow::new(state(0.2), GRAVITY).unwrap();
    window.push(integrate(0.2, 1.2, &bias(), bias())).unwrap();
    let (found, truth) = (window.states()[1], state(1.2));
    let (distance, angle) = found.pose.distance_and_angle(&truth.pose);
    // the middle rule at 1 kHz: errors of the square of the step
    assert!(distance < 1e-5 && angle < 1e-6, "{distance:e} {angle:e}");
    assert!((found.velocity - truth.velocity).norm() < 1e-5);
}

#[test]
fn change_of_bias_equals_integration_with_that_bias() {
    let other = ImuBias {
        gyro: bias().gyro + Vector3::new(1e-4, 2e-4, -1e-4),
        accel: bias().accel + Vector3::new(-1e-3, 2e-3, 1e-3),
    };
    let (around, again) = (
        integrate(0.0, 0.5, &bias(), bias()),
        integrate(0.0, 0.5, &bias(), other),
    );
    let (first, second) = (around.corrected(&other), again.corrected(&other));
    // to first order in a change of 2e-4: what is left is its square
    assert!(first.0.angle_to(&second.0) < 1e-7);
    assert!((first.1 - second.1).norm() < 1e-6);
    assert!((first.2 - second.2).norm() < 1e-6);
}

#[test]
fn covariance_equals_monte_carlo() {
    let exact = integrate(0.0, 0.2, &bias(), bias()).corrected(&bias());
    let mut random = Random::new(4);
    let (runs, mut sum) = (400, nalgebra::SMatrix::<f64, 9, 9>::zeros());
    let mut predicted = None;
    for _ in 0..runs {
        let mut noisy = Preintegration::new(bias(), SIGMAS).unwrap();
        for k in 0..200 {
            let (gyro, accel) = measure((f64::from(k) + 0.5) * 1e-3, &bias());
            // a density is a standard deviation at 1 Hz
            let scale = 1.0 / f64::sqrt(1e-3);
            let gyro = gyro + random.normal::<3>(SIGMAS.gyro * scale);
            let accel = accel + random.normal::<3>(SIGMAS.accel * scale);
            noisy.push(&gyro, &accel, 1e-3).unwrap();
        }
        let found = noisy.corrected(&bias());
        let turn = so3::log(&(exact.0.inverse() * found.0));
        let mut e = SVector::<f64, 9>::zeros();
        e.fixed_rows_mut::<3>(0).copy_from(&turn);
        e.fixed_rows_mut::<3>(3).copy_from(&(found.1 - exact.1));
        e.fixed_rows_mut::<3>(6).copy_from(&(found.2 - exact.2));
        sum += e * e.transpose();
        predicted.get_or_insert(noisy.covariance);
    }
    let predicted = predicted.unwrap();
    for k in 0..9 {
        let ratio = (sum[(k, k)] / f64::from(runs) / predicted[(k, k)]).sqrt();
        // 400 samples: 3.5 %, four of those
        assert!((ratio - 1.0).abs() < 0.14, "{k} {ratio}");
    }
}

/// A change of a state.
pub(crate) fn shift(seed: f64) -> SVector<f64, 15> {
    SVector::from_fn(|k, _| 0.03 * (seed + 1.9 * k as f64).sin())
}

#[test]
fn derivatives_of_a_link_equal_differences() {
    let mut window = InertialWindow::new(state(0.2), GRAVITY).unwrap();
    window.push(integrate(0.2, 0.6, &bias(), bias())).unwrap();
    let states = [
        moved(&window.states()[0], &shift(1.0)),
        moved(&window.states()[1], &shift(2.0)),
    ];
    let (_, by_first, by_second) = window.link(0, &states);
    for (which, analytic) in [by_first, by_second].iter().enumerate() {
        for k in 0..15 {
            let residual = |h: f64| {
                let mut at = states;
                let d = SVector::<f64, 15>::from_fn(|r, _| if r == k { h } else { 0.0 });
                at[which] = moved(&states[which], &d);
                window.link(0, &at).0
            };
            let numeric = (residual(1e-5) - residual(-1e-5)) / 2e-5;
            let error = (numeric - analytic.column(k)).norm();
            assert!(
                error < 1e-6 * (1.0 + analytic.column(k).norm()),
                "{which} {k} {error:e}"
            );
        }
    }
}

#[test]
fn window_of_measured_poses_finds_biases_and_velocities() {
    let mut window = InertialWindow::new(
        InertialState {
            bias: ImuBias::default(),
            velocity: Vector3::zeros(),
            ..state(0.0)
        },
        GRAVITY,
    )
    .unwrap();
    let covariance = Matrix6::identity() * 1e-8;
    window.add_pose(0, pose(0.0), &covariance).unwrap();
    window.add_bias(0, ImuBias::default(), (0.1, 1.0)).unwrap();
    for k in 0..8 {
        let t = 0.3 * f64::from(k);
        let next = window
            .push(integrate(t, t + 0.3, &bias(), ImuBias::default()))
            .unwrap();
        window.add_pose(next, pose(t + 0.3), &covariance).unwrap();
    }
    let options = Options {
        function_tolerance: 1e-12,
        ..Options::default()
    };
    let summary = window.solve(&options).unwrap();
    let found = window.states()[4];
    println!("{:?} {}", found.bias, summary.final_cost);
    assert!((found.bias.gyro - bias().gyro).norm() < 1e-3);
    assert!((found.bias.accel - bias().accel).norm() < 2e-2);
    assert!((found.velocity - velocity(1.2)).norm() < 1e-2);
}

#[test]
fn bad_samples_are_errors_by_name() {
    let mut all = Preintegration::new(bias(), SIGMAS).unwrap();
    let (zero, nan) = (Vector3::zeros(), Vector3::repeat(f64::NAN));
    let mut window = InertialWindow::new(InertialState::default(), GRAVITY).unwrap();
    let wrong = ImuSigmas {
        gyro: 0.0,
        ..SIGMAS
    };
    for (name, error) in [
        ("gyro", all.push(&nan, &zero, 0.1).err()),
        ("accel", all.push(&zero, &nan, 0.1).err()),
        ("dt_s", all.push(&zero, &zero, -0.1).err()),
        ("sigmas.gyro", Preintegration::new(bias(), wrong).err()),
        ("since_last", window.push(all.clone()).err()),
        (
            "state",
            window
                .add_pose(3, Pose::identity(), &Matrix6::identity())
                .err(),
        ),
        (
            "covariance",
            window
                .add_pose(0, Pose::identity(), &Matrix6::zeros())
                .err(),
        ),
    ] {
        let text = error.map(|e| e.to_string()).unwrap_or_default();
        assert!(text.starts_with(name), "{name}: {text}");
    }
}
