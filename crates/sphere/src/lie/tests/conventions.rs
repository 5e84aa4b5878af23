//! Signs, frames and orders: kinematics by differences, and the errata of appendix C.

use super::*;
use crate::lie::{motion, quaternion, so3};
use nalgebra::{Matrix3, Quaternion};
use sphereflow_core::{Pose, Twist};

/// Central differences over 2e-5 s of a smooth path: 1e-10, and rounding 1e-11.
const STEP_S: f64 = 1e-5;
const DIFFERENCE: f64 = 1e-9;

/// A body that turns and moves as a smooth function of time.
fn pose_at(t_s: f64) -> Pose {
    let w = Vector3::new(0.7 * (1.3 * t_s).sin(), 0.4 * t_s, 0.9 * (0.8 * t_s).cos());
    let c = Vector3::new(t_s.cos(), 0.3 * t_s * t_s, (2.0 * t_s).sin());
    Pose::new(so3::exp(&w), c)
}

/// Its twist, from the relative motion over a short while.
fn twist_at(t_s: f64) -> Twist {
    let (before, after) = (pose_at(t_s - STEP_S), pose_at(t_s + STEP_S));
    motion::twist_between(&before, &after, 2.0 * STEP_S).unwrap()
}

#[test]
fn quaternion_rate_is_half_q_omega_with_omega_in_the_body() {
    // Thesis: eq. (1.8). Thesis: eq. (C.4).
    for t_s in [0.0, 0.4, 1.7, 3.1] {
        let before = pose_at(t_s - STEP_S).rotation;
        let after = quaternion::continued(&pose_at(t_s + STEP_S).rotation, &before);
        let difference = (after.into_inner() - before.into_inner()) / (2.0 * STEP_S);
        let (q, omega) = (pose_at(t_s).rotation, twist_at(t_s).angular_rad_s);
        let rate = quaternion::rate(&quaternion::continued(&q, &before), &omega);
        assert!((difference - rate).norm() < DIFFERENCE, "{t_s}");
        let again = quaternion::angular_velocity(&q, &quaternion::rate(&q, &omega));
        assert!((again - omega).norm() < 1e-15);
        // the other order, omega in the world, is a different motion
        let wrong = Quaternion::from_imag(omega) * q.into_inner() * 0.5;
        assert!((difference - wrong).norm() > 1e-2, "{t_s}");
    }
}

#[test]
fn centre_moves_with_the_body_velocity_turned_to_the_world() {
    // Thesis: eq. (1.8): C' = q v q*
    for t_s in [0.0, 0.4, 1.7, 3.1] {
        let (before, after) = (pose_at(t_s - STEP_S), pose_at(t_s + STEP_S));
        let difference = (after.translation - before.translation) / (2.0 * STEP_S);
        let (q, v) = (pose_at(t_s).rotation.into_inner(), twist_at(t_s).linear_m_s);
        let turned = q * Quaternion::from_imag(v) * q.conjugate();
        assert!((difference - turned.imag()).norm() < DIFFERENCE, "{t_s}");
    }
}

#[test]
fn static_point_moves_against_the_body() {
    // X' = -v - omega x X
    let (t_s, world) = (0.9, Vector3::new(2.0, -1.0, 4.0));
    let seen = |t_s: f64| pose_at(t_s).inverse().transform(&world);
    let difference = (seen(t_s + STEP_S) - seen(t_s - STEP_S)) / (2.0 * STEP_S);
    let twist = twist_at(t_s);
    let expected = -twist.linear_m_s - twist.angular_rad_s.cross(&seen(t_s));
    assert!((difference - expected).norm() < DIFFERENCE);
}

#[test]
fn static_point_of_two_frames_is_related_by_the_exponential() {
    // X1 = R X2 + p, (R, p) = exp([omega, v] dt)
    let twist = Twist {
        angular_rad_s: Vector3::new(0.2, -0.5, 0.9),
        linear_m_s: Vector3::new(0.3, 0.1, -0.4),
    };
    let (dt_s, first) = (0.7, pose_at(0.3));
    let second = motion::advance(&first, &twist, dt_s);
    let world = Vector3::new(2.0, -1.0, 4.0);
    let (x1, x2) = (
        first.inverse().transform(&world),
        second.inverse().transform(&world),
    );
    let exponential = crate::lie::se3::exp(&(twist.vector() * dt_s));
    assert!((x1 - exponential.transform(&x2)).norm() < 1e-14);
    let again = motion::twist_between(&first, &second, dt_s).unwrap();
    assert!((again.vector() - twist.vector()).norm() < 1e-14);
    // Thesis: eq. (C.7): world-to-camera K' = exp(minus the twist) K
    let opposite = crate::lie::se3::exp(&(-twist.vector() * dt_s)) * first.inverse();
    assert!((opposite.matrix() - second.inverse().matrix()).norm() < 1e-14);
}

#[test]
fn advance_in_steps_equals_advance_at_once() {
    let twist = twist_at(1.1);
    let mut pose = pose_at(1.1);
    let whole = motion::advance(&pose, &twist, 1.0);
    for _ in 0..1000 {
        pose = motion::advance(&pose, &twist, 1e-3);
    }
    assert!((pose.matrix() - whole.matrix()).norm() < 1e-12); // 1000 roundings
}

#[test]
fn twist_between_without_time_is_an_error() {
    for dt_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = motion::twist_between(&pose_at(0.0), &pose_at(1.0), dt_s).unwrap_err();
        assert!(error.to_string().starts_with("dt_s:"), "{error}");
    }
}

#[test]
fn quaternion_cross_product_has_the_opposite_sign_of_the_printed_one() {
    // Thesis: section C.1.2 prints (p q* - q p*) / 2; the cross product is (p q - q p) / 2
    let (a, b) = (Vector3::new(0.3, -1.2, 0.7), Vector3::new(-2.0, 0.1, 0.4));
    let (p, q) = (Quaternion::from_imag(a), Quaternion::from_imag(b));
    assert!((((p * q - q * p) * 0.5).imag() - a.cross(&b)).norm() < 1e-15);
    let printed = (p * q.conjugate() - q * p.conjugate()) * 0.5;
    assert!((printed.imag() + a.cross(&b)).norm() < 1e-15);
}

#[test]
fn printed_rotation_matrix_is_that_of_q_x_q_conjugate() {
    // Thesis: section C.1.2 prints x -> q* x q beside the matrix of x -> q x q*
    let q = attitude();
    let (w, x, y, z) = (q.w, q.i, q.j, q.k);
    let printed = Matrix3::new(
        w * w + x * x - y * y - z * z,
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        w * w - x * x + y * y - z * z,
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        w * w - x * x - y * y + z * z,
    );
    let point = Vector3::new(0.3, -1.2, 0.7);
    let turned = q.into_inner() * Quaternion::from_imag(point) * q.into_inner().conjugate();
    assert!((printed * point - turned.imag()).norm() < 1e-14);
    assert!((q * point - turned.imag()).norm() < 1e-14);
}
