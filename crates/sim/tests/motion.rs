//! The exact derivatives of the camera paths, against differences of their poses.

use nalgebra::{Quaternion, Vector3};
use sphereflow_sim::Motion;

/// Step of the sixth-order differences, seconds: truncation (h^6 times the seventh derivative) and
/// rounding (1e-16 / h) both stay below the tolerance.
const STEP_S: f64 = 2e-3;
/// Of rates and accelerations: rounding of the poses over the step.
const TOLERANCE: f64 = 1e-10;

fn motions() -> Vec<(&'static str, Motion)> {
    vec![
        ("sinusoids_411", Motion::sinusoids_411()),
        ("hand_held", Motion::hand_held(3)),
        ("trolley", Motion::trolley(3)),
        ("room_tour", Motion::room_tour(3)),
        ("still", Motion::still()),
    ]
}

/// Sixth-order central difference of `f` at `t`.
fn derivative<T>(t: f64, f: impl Fn(f64) -> T) -> T
where
    T: std::ops::Sub<Output = T> + std::ops::Add<Output = T> + std::ops::Mul<f64, Output = T>,
{
    let pair = |k: f64| f(t + k * STEP_S) - f(t - k * STEP_S);
    (pair(1.0) * 45.0 - pair(2.0) * 9.0 + pair(3.0)) * (1.0 / (60.0 * STEP_S))
}

#[test]
fn motion_quaternion_derivative_is_half_q_omega() {
    // Thesis: eq. (1.8). q' = q omega / 2, Hamilton product, omega in the body frame.
    for (name, motion) in motions() {
        for k in 0..40 {
            let t = 0.173 * f64::from(k);
            let state = motion.state(t);
            let q = *state.world_from_camera.rotation.quaternion();
            let omega = Quaternion::from_imag(state.twist.angular_rad_s);
            let found = derivative(t, |t| {
                let other = *motion.pose(t).rotation.quaternion();
                if other.dot(&q) < 0.0 { -other } else { other }
            });
            let error = (found - q * omega * 0.5).norm();
            assert!(error < TOLERANCE, "{name} at {t}: {error}");
            // The product in the other order is the rate in the world frame: it does not fit.
            let other = (found - omega * q * 0.5).norm();
            if name == "hand_held" && omega.norm() > 0.3 {
                assert!(other > 1e-4, "{name} at {t}: {other}");
            }
        }
    }
}

#[test]
fn motion_position_derivative_is_q_v_q_conjugate() {
    // Thesis: eq. (1.8). C' = q v q*.
    for (name, motion) in motions() {
        for k in 0..40 {
            let t = 0.173 * f64::from(k);
            let state = motion.state(t);
            let rotation = state.world_from_camera.rotation;
            let found = derivative(t, |t| motion.pose(t).translation);
            let error = (found - rotation * state.twist.linear_m_s).norm();
            assert!(error < TOLERANCE, "{name} at {t}: {error}");
        }
    }
}

#[test]
fn motion_accelerations_agree_with_differences_of_velocities() {
    for (name, motion) in motions() {
        for k in 0..40 {
            let t = 0.173 * f64::from(k);
            let state = motion.state(t);
            let velocity = |t: f64| {
                let s = motion.state(t);
                s.world_from_camera.rotation * s.twist.linear_m_s
            };
            let linear = (derivative(t, velocity) - state.accel_world_m_s2).norm();
            let omega = |t: f64| motion.state(t).twist.angular_rad_s;
            let angular = (derivative(t, omega) - state.angular_accel_rad_s2).norm();
            assert!(
                linear < TOLERANCE && angular < TOLERANCE,
                "{name} at {t}: {linear} {angular}"
            );
        }
    }
}

#[test]
fn motion_body_velocity_derivative_with_specific_force_has_gravity_added() {
    // Thesis: eq. (C.5), corrected: v' = v x omega + a + q* G q with G = (0, 9.81, 0) the gravity
    // of a world whose y points down, and a = q* C'' q - q* G q what an accelerometer reads. The
    // printed "- q* A q" with the same A = (0, 9.81, 0) is wrong by twice the gravity.
    let gravity = Vector3::new(0.0, 9.81, 0.0);
    for (name, motion) in motions() {
        for k in 0..40 {
            let t = 0.173 * f64::from(k);
            let state = motion.state(t);
            let body_from_world = state.world_from_camera.rotation.inverse();
            let specific_force = body_from_world * (state.accel_world_m_s2 - gravity);
            let (omega, v) = (state.twist.angular_rad_s, state.twist.linear_m_s);
            let found = derivative(t, |t| motion.state(t).twist.linear_m_s);
            let corrected = v.cross(&omega) + specific_force + body_from_world * gravity;
            assert!((found - corrected).norm() < TOLERANCE, "{name} at {t}");
            let printed = v.cross(&omega) + specific_force - body_from_world * gravity;
            assert!((found - printed).norm() > 19.0, "{name} at {t}");
        }
    }
}

#[test]
fn motion_angles_turn_right_look_up_and_roll_clockwise_when_positive() {
    let ahead = |motion: &Motion| motion.pose(0.0).rotation * Vector3::z();
    let mut motion = Motion::still();
    motion.yaw_rad.offset = 0.3;
    assert!(ahead(&motion).x > 0.2);
    motion = Motion::still();
    motion.pitch_rad.offset = 0.3;
    assert!(ahead(&motion).y < -0.2, "y is down: up is negative");
    motion = Motion::still();
    motion.roll_rad.offset = 0.3;
    // Clockwise as seen along z: the camera's x axis dips.
    assert!((motion.pose(0.0).rotation * Vector3::x()).y > 0.2);
}

#[test]
fn motion_411_stands_still_at_one_and_three_seconds() {
    // Thesis: section 4.1.1, Figures 4.1 and 4.2: the shape of the curves; part of the errors'
    // peaks in 4.1.2 come from the instants without linear velocity.
    let motion = Motion::sinusoids_411();
    let speed = |t: f64| motion.state(t).twist.linear_m_s.norm();
    assert!(speed(1.0) < 1e-12 && speed(3.0) < 1e-12);
    let times = || (0..=400).map(|k| f64::from(k) * 0.01);
    let fastest = times().map(speed).fold(0.0, f64::max);
    let turning = times()
        .map(|t| motion.state(t).twist.angular_rad_s.norm())
        .fold(0.0, f64::max);
    assert!((fastest - 0.60).abs() < 0.01, "{fastest}");
    assert!((turning - 0.30).abs() < 0.02, "{turning}");
}

#[test]
fn motion_hand_held_has_the_stated_speed_and_rate() {
    // Incommensurable sines need a long time to reach their mean; Euler rates are body rates to
    // the second order of the angles. Both leave some per cent.
    for seed in 0..4 {
        let motion = Motion::hand_held(seed);
        let (mut v2, mut w2) = (0.0, 0.0);
        let count = 40_000;
        for k in 0..count {
            let twist = motion.state(0.01 * f64::from(k)).twist;
            v2 += twist.linear_m_s.norm_squared();
            w2 += twist.angular_rad_s.norm_squared();
        }
        let [v, w] = [v2, w2].map(|sum| (sum / f64::from(count)).sqrt());
        assert!((v / 0.28 - 1.0).abs() < 0.03, "seed {seed}: {v} m/s");
        assert!((w / 0.39 - 1.0).abs() < 0.06, "seed {seed}: {w} rad/s");
    }
}

#[test]
fn motion_trolley_stays_in_its_plane_and_turns_about_the_vertical() {
    let motion = Motion::trolley(1);
    for k in 0..100 {
        let state = motion.state(0.3 * f64::from(k));
        assert_eq!(state.world_from_camera.translation.y, 0.0);
        assert!(state.twist.angular_rad_s.xz().norm() < 1e-15);
    }
}
