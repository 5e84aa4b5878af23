//! Rotations: exponential and logarithm at every angle, Jacobians against differences.

use super::*;
use crate::lie::so3::*;
use nalgebra::Matrix3;

/// A few roundings of numbers up to pi.
const ROUNDING: f64 = 4e-15;
/// Central differences of step 1e-5: truncation 1e-10, rounding 1e-16 / 1e-5.
const STEP: f64 = 1e-5;
const DIFFERENCE: f64 = 1e-9;

#[test]
fn log_of_exp_returns_from_the_smallest_angle_to_the_half_turn() {
    for angle in ANGLES {
        for axis in axes() {
            let w = axis * angle;
            let q = exp(&w);
            assert!((q.norm() - 1.0).abs() < 1e-15, "{angle}");
            let again = log(&q);
            // relative, so that the digits of a tiny rotation are kept too
            let other_way = if angle == PI {
                (again + w).norm()
            } else {
                f64::INFINITY
            };
            let error = (again - w).norm().min(other_way);
            assert!(error <= ROUNDING * angle, "{angle}: {error:e}");
        }
    }
}

#[test]
fn exp_of_log_returns_at_exactly_pi_and_beyond() {
    for axis in axes() {
        for scalar in [0.0, -0.0, 1e-17, -1e-17] {
            let q = UnitQuaternion::new_unchecked(nalgebra::Quaternion::from_parts(scalar, axis));
            let w = log(&q);
            assert!((w.norm() - PI).abs() < ROUNDING, "{scalar}: {}", w.norm());
            assert!(exp(&w).angle_to(&q) < 1e-7); // angle_to loses half of the digits near 0
            let axis_error = w.normalize().cross(&axis).norm();
            assert!(axis_error < ROUNDING, "{axis_error:e}");
        }
        // 1.25 turns on: the same rotation as a quarter turn
        let w = log(&exp(&(axis * (2.5 * PI))));
        assert!((w - axis * (0.5 * PI)).norm() < ROUNDING * 4.0);
        // just past the half turn the shorter way is the other way about
        let w = log(&exp(&(axis * (PI + 1e-9))));
        assert!((w + axis * (PI - 1e-9)).norm() < ROUNDING * 4.0);
    }
}

#[test]
fn exp_and_log_are_continuous_across_the_change_of_formula() {
    for middle in [1.0, 2.0e-4, 2.0] {
        for axis in axes() {
            let (below, above) = (
                axis * (middle * (1.0 - 1e-14)),
                axis * (middle * (1.0 + 1e-14)),
            );
            let step = (exp(&above).coords - exp(&below).coords).norm();
            assert!(step < 3e-14 * middle + 1e-15, "{middle}: {step:e}");
            let step = (log(&exp(&above)) - log(&exp(&below))).norm();
            assert!(
                step < 3e-14 * middle + ROUNDING * middle,
                "{middle}: {step:e}"
            );
            for jacobian in [left_jacobian, left_jacobian_inverse] {
                let step = (jacobian(&above) - jacobian(&below)).norm();
                assert!(step < 1e-13, "{middle}: {step:e}");
            }
        }
    }
}

#[test]
fn exp_equals_the_micro_rotator_of_the_thesis() {
    // Thesis: section C.1.1: I + sin t / t T + (1 - cos t) / t^2 T^2
    for angle in [1e-3, 0.5, 1.5, 3.0] {
        for axis in axes() {
            let big = hat(&(axis * angle));
            let rotator = Matrix3::identity()
                + big * (angle.sin() / angle)
                + big * big * ((1.0 - angle.cos()) / (angle * angle));
            let error = (adjoint(&exp(&(axis * angle))) - rotator).norm();
            assert!(error < 1e-10, "{angle}: {error:e}"); // the printed form cancels at 1e-3
        }
    }
}

#[test]
fn hat_is_the_cross_product_and_vee_its_inverse() {
    // Thesis: eq. (C.1)
    let (a, b) = (Vector3::new(0.3, -1.2, 0.7), Vector3::new(-2.0, 0.1, 0.4));
    assert!((hat(&a) * b - a.cross(&b)).norm() < 1e-15);
    assert_eq!(vee(&hat(&a)), a);
}

fn numeric(f: impl Fn(&Vector3<f64>) -> Vector3<f64>) -> Matrix3<f64> {
    Matrix3::from_columns(
        &[Vector3::x(), Vector3::y(), Vector3::z()]
            .map(|axis| (f(&(axis * STEP)) - f(&(axis * -STEP))) / (2.0 * STEP)),
    )
}

#[test]
fn jacobians_equal_differences_at_every_angle() {
    for angle in ANGLES {
        for axis in axes() {
            let w = axis * angle;
            let q = exp(&w);
            let left = numeric(|d| log(&(exp(&(w + d)) * q.inverse())));
            assert!(
                (left - left_jacobian(&w)).norm() < DIFFERENCE,
                "left at {angle}"
            );
            let right = numeric(|d| log(&(q.inverse() * exp(&(w + d)))));
            assert!(
                (right - right_jacobian(&w)).norm() < DIFFERENCE,
                "right at {angle}"
            );
            if angle < PI - 1e-3 {
                let inverse = numeric(|d| log(&(q * exp(d))));
                let error = (inverse - right_jacobian_inverse(&w)).norm();
                assert!(error < DIFFERENCE, "inverse at {angle}: {error:e}");
            }
        }
    }
}

proptest! {
    #[test]
    fn jacobian_times_its_inverse_is_the_identity(w in vector(3.3)) {
        let one = Matrix3::identity();
        // the inverse grows towards the full turn
        prop_assert!((left_jacobian(&w) * left_jacobian_inverse(&w) - one).norm() < 1e-12);
        prop_assert!((right_jacobian(&w) * right_jacobian_inverse(&w) - one).norm() < 1e-12);
    }

    #[test]
    fn log_of_exp_returns_within_the_half_turn(w in vector(PI / 3.0_f64.sqrt())) {
        prop_assert!((log(&exp(&w)) - w).norm() < ROUNDING);
    }

    #[test]
    fn adjoint_moves_rotation_vectors(w in vector(1.7)) {
        let q = attitude();
        let moved = log(&(q * exp(&w) * q.inverse()));
        prop_assert!((moved - adjoint(&q) * w).norm() < 2.0 * ROUNDING);
    }
}
