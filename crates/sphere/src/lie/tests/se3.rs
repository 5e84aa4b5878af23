//! Rigid motions: exponential and logarithm, adjoint, Jacobians against differences.

use super::*;
use crate::lie::se3::*;
use nalgebra::{Matrix4, Matrix6};
use sphereflow_core::Pose;

/// Roundings of a few products of numbers up to 10.
const ROUNDING: f64 = 1e-13;
/// Central differences of step 1e-5 of numbers up to 10: 1e-10 either way, times some.
const STEP: f64 = 1e-5;
const DIFFERENCE: f64 = 1e-8;

fn twist_of(angle: f64, axis: Vector3<f64>) -> Vector6<f64> {
    let w = axis * angle;
    Vector6::new(w.x, w.y, w.z, 0.7, -1.3, 2.1)
}

#[test]
fn log_of_exp_returns_at_every_angle() {
    for angle in ANGLES {
        for axis in axes() {
            let xi = twist_of(angle, axis);
            let again = log(&exp(&xi));
            let error = (again - xi).norm();
            // at pi the other way about is as good
            assert!(error < ROUNDING || angle == PI, "{angle}: {error:e}");
            assert!(
                (exp(&again).matrix() - exp(&xi).matrix()).norm() < ROUNDING,
                "{angle}"
            );
        }
    }
}

#[test]
fn exp_equals_the_power_series_of_the_matrix() {
    // Thesis: section C.3: the elements are (Omega, V), rows (Omega V; 0 0)
    for axis in axes() {
        let xi = twist_of(1.3, axis);
        let (mut term, mut sum) = (Matrix4::identity(), Matrix4::identity());
        for k in 1..40 {
            term = term * hat(&xi) / f64::from(k);
            sum += term;
        }
        assert!((exp(&xi).matrix() - sum).norm() < ROUNDING);
        assert_eq!(vee(&hat(&xi)), xi);
    }
}

#[test]
fn jacobians_equal_differences_at_every_angle() {
    for angle in ANGLES {
        for axis in axes() {
            let xi = twist_of(angle, axis);
            let pose = exp(&xi);
            let left = numeric(|d| log(&(exp(&(xi + d)) * pose.inverse())));
            let error = (left - left_jacobian(&xi)).norm();
            assert!(error < DIFFERENCE, "left at {angle}: {error:e}");
            let right = numeric(|d| log(&(pose.inverse() * exp(&(xi + d)))));
            let error = (right - right_jacobian(&xi)).norm();
            assert!(error < DIFFERENCE, "right at {angle}: {error:e}");
            if angle < PI - 1e-3 {
                let inverse = numeric(|d| log(&(pose * exp(d))));
                let error = (inverse - right_jacobian_inverse(&xi)).norm();
                assert!(error < DIFFERENCE, "inverse at {angle}: {error:e}");
            }
        }
    }
}

fn numeric(f: impl Fn(&Vector6<f64>) -> Vector6<f64>) -> Matrix6<f64> {
    let mut jacobian = Matrix6::zeros();
    for axis in 0..6 {
        let mut step = Vector6::zeros();
        step[axis] = STEP;
        jacobian.set_column(axis, &((f(&step) - f(&-step)) / (2.0 * STEP)));
    }
    jacobian
}

#[test]
fn small_adjoint_is_the_bracket_of_matrices() {
    let (a, b) = (twist_of(0.8, axes()[2]), twist_of(-1.9, axes()[3]));
    let bracket = vee(&(hat(&a) * hat(&b) - hat(&b) * hat(&a)));
    assert!((small_adjoint(&a) * b - bracket).norm() < ROUNDING);
}

proptest! {
    #[test]
    fn exp_of_log_returns_any_pose(w in vector(10.0), t in vector(5.0)) {
        let pose = Pose::new(crate::lie::so3::exp(&w), t);
        let again = exp(&log(&pose));
        prop_assert!((again.matrix() - pose.matrix()).norm() < ROUNDING);
    }

    #[test]
    fn adjoint_moves_twists(xi in twist(1.5, 3.0), w in vector(2.0), t in vector(5.0)) {
        let pose = Pose::new(crate::lie::so3::exp(&w), t);
        let moved = pose * exp(&xi) * pose.inverse();
        let expected = exp(&(adjoint(&pose) * xi));
        prop_assert!((moved.matrix() - expected.matrix()).norm() < ROUNDING);
    }

    #[test]
    fn jacobian_times_its_inverse_is_the_identity(xi in twist(1.8, 3.0)) {
        let one = Matrix6::identity();
        prop_assert!((left_jacobian(&xi) * left_jacobian_inverse(&xi) - one).norm() < ROUNDING);
        prop_assert!((right_jacobian(&xi) * right_jacobian_inverse(&xi) - one).norm() < ROUNDING);
    }
}
