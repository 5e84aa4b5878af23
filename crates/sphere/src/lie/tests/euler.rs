//! Yaw, pitch and roll: signs, there and back, gimbal lock, the erratum.

use super::*;
use crate::lie::Euler;
use nalgebra::Matrix3;
use std::f64::consts::FRAC_PI_2;

/// Rounding of nine products.
const ROUNDING: f64 = 2e-15;

fn euler(yaw_rad: f64, pitch_rad: f64, roll_rad: f64) -> Euler {
    Euler {
        yaw_rad,
        pitch_rad,
        roll_rad,
    }
}

fn matrix(q: &UnitQuaternion<f64>) -> Matrix3<f64> {
    q.to_rotation_matrix().into_inner()
}

#[test]
fn yaw_turns_right_pitch_looks_up_roll_is_clockwise() {
    // Thesis: section C.1.3, camera x right, y down, z forward
    let forward = |e: Euler| e.rotation() * Vector3::z();
    assert!(forward(euler(0.1, 0.0, 0.0)).x > 0.09);
    assert!(forward(euler(0.0, 0.1, 0.0)).y < -0.09); // up is -y
    let right = euler(0.0, 0.0, 0.1).rotation() * Vector3::x();
    assert!(right.y > 0.09); // from right to down: clockwise, looking along z
}

#[test]
fn printed_r_theta_and_r_phi_are_transposed_erratum() {
    // Thesis: section C.1.3 prints R = R_phi R_theta R_psi from world to camera
    let (psi, theta, phi) = (0.7_f64, -0.4_f64, 1.1_f64);
    let (s, c) = psi.sin_cos();
    let r_psi = Matrix3::new(c, 0.0, -s, 0.0, 1.0, 0.0, s, 0.0, c);
    let (s, c) = theta.sin_cos();
    let r_theta = Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c);
    let (s, c) = phi.sin_cos();
    let r_phi = Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
    let camera_from_world = matrix(&euler(psi, theta, phi).rotation()).transpose();
    let corrected = r_phi.transpose() * r_theta.transpose() * r_psi;
    assert!((camera_from_world - corrected).norm() < ROUNDING);
    assert!((camera_from_world - r_phi * r_theta * r_psi).norm() > 0.5);
}

#[test]
fn angles_return_on_a_grid() {
    for yaw in [-3.1, -1.0, 0.0, 0.3, 2.5] {
        for pitch in [-1.57, -0.7, 0.0, 1e-9, 1.2, 1.57] {
            for roll in [-3.0, -0.2, 0.0, 1.9] {
                let again = Euler::from_rotation(&euler(yaw, pitch, roll).rotation());
                // yaw and roll are told to rounding over cos(pitch), 8e-4 at 1.57
                let tolerance = 4e-16 / pitch.cos() + ROUNDING;
                assert!(
                    (again.yaw_rad - yaw).abs() < tolerance,
                    "{yaw} {pitch} {roll}"
                );
                assert!(
                    (again.roll_rad - roll).abs() < 2.0 * tolerance,
                    "{yaw} {pitch} {roll}"
                );
                assert!(
                    (again.pitch_rad - pitch).abs() < tolerance,
                    "{yaw} {pitch} {roll}"
                );
                assert!(!again.is_gimbal_locked());
            }
        }
    }
}

#[test]
fn gimbal_lock_keeps_the_rotation_and_gives_the_turn_to_yaw() {
    for sign in [-1.0, 1.0] {
        for below in [0.0, 1e-15, 1e-13, 1e-11, 1e-8] {
            let given = euler(0.8, sign * (FRAC_PI_2 - below), 0.5);
            let again = Euler::from_rotation(&given.rotation());
            let error = (matrix(&again.rotation()) - matrix(&given.rotation())).norm();
            // rounding, and the cosine of pitch that counts as none
            assert!(error < 1e-14, "{sign} {below}: {error:e}");
            if below < 1e-15 {
                assert!(again.is_gimbal_locked());
                assert!(again.roll_rad.abs() < 1e-12, "{}", again.roll_rad);
                assert!(
                    (again.yaw_rad - (0.8 - sign * 0.5)).abs() < 1e-12,
                    "{}",
                    again.yaw_rad
                );
            }
        }
    }
}

proptest! {
    #[test]
    fn any_rotation_returns_through_its_angles(w in vector(4.0)) {
        let q = crate::lie::so3::exp(&w);
        let e = Euler::from_rotation(&q);
        prop_assert!(e.pitch_rad.abs() <= FRAC_PI_2);
        prop_assert!((matrix(&e.rotation()) - matrix(&q)).norm() < 1e-14);
    }
}
