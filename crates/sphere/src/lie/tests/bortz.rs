//! The coning correction: its order, and the figure of a coning motion.

use super::*;
use crate::lie::{bortz, quaternion, so3};
use nalgebra::Quaternion;
use sphereflow_core::{ImuSample, Stamp};

/// A coning motion: the axis about which the body is tilted goes around twice a second.
const TILT_RAD: f64 = 8.7 * PI / 180.0;
const TURN_RAD_S: f64 = 2.0 * PI * 2.0;
const SECONDS: f64 = 4.0;

fn truth(t_s: f64) -> UnitQuaternion<f64> {
    let (sine, cosine) = (TURN_RAD_S * t_s).sin_cos();
    so3::exp(&(Vector3::new(cosine, sine, 0.0) * TILT_RAD))
}

/// Its exact angular velocity in the body, by `2 q* q'`.
fn omega(t_s: f64) -> Vector3<f64> {
    let (sine, cosine) = (TURN_RAD_S * t_s).sin_cos();
    let size = (0.5 * TILT_RAD).sin() * TURN_RAD_S;
    let rate = Quaternion::new(0.0, -size * sine, size * cosine, 0.0);
    quaternion::angular_velocity(&truth(t_s), &rate)
}

/// Angle between the truth and the attitude after 4 s, with a rotation for every step of `dt_s`.
fn final_error(dt_s: f64, step: impl Fn(f64) -> UnitQuaternion<f64>) -> f64 {
    let mut q = truth(0.0);
    let steps = (SECONDS / dt_s).round() as usize;
    for k in 0..steps {
        q *= step(k as f64 * dt_s);
    }
    so3::log(&(q.inverse() * truth(SECONDS))).norm()
}

/// (C.3) over one step, from gyro samples `sample_s` apart.
fn bortz_step(start_s: f64, dt_s: f64, sample_s: f64) -> UnitQuaternion<f64> {
    let count = (dt_s / sample_s).round() as usize;
    let mut vector = bortz::RotationVector::starting(omega(start_s));
    for i in 1..=count {
        vector.push(omega(start_s + i as f64 * sample_s), sample_s);
    }
    vector.take()
}

#[test]
fn coning_at_25_hz_drifts_by_2e_5_rad_and_by_1e_2_without_the_correction() {
    // Thesis: eq. (C.3); 25 Hz updates from gyro samples at 1 kHz, 4 s
    let dt_s = 0.04;
    let bortz = final_error(dt_s, |t_s| bortz_step(t_s, dt_s, 1e-3));
    let plain = final_error(dt_s, |t_s| so3::exp(&(omega(t_s) * dt_s)));
    let mean = final_error(dt_s, |t_s| {
        // the angle increment, as an integrating gyro gives it, without coning
        let samples = (0..=40).map(|i| (i, omega(t_s + f64::from(i) * 1e-3)));
        let ends = |i: i32| if i == 0 || i == 40 { 0.5 } else { 1.0 };
        so3::exp(&(samples.map(|(i, w)| w * ends(i)).sum::<Vector3<f64>>() * 1e-3))
    });
    println!("coning 4 s, rad: (C.3) {bortz:.1e}, q exp(w dt) {plain:.1e}, mean rate {mean:.1e}");
    assert!(bortz < 2.2e-5, "{bortz:e}");
    assert!((1.0e-2..1.4e-2).contains(&plain), "{plain:e}");
    assert!(mean > 1.0e-2, "{mean:e}");
}

#[test]
fn coning_error_falls_with_the_fourth_power_of_the_step() {
    // samples at 25 kHz, so that what is left is the order of (C.3): its third-order terms go around
    // with the cone, and the drift is of the fourth power of the step
    let error = |dt_s: f64| final_error(dt_s, |t_s| bortz_step(t_s, dt_s, 4e-5));
    let (coarse, fine) = (error(0.08), error(0.04));
    assert!(
        (12.0..20.0).contains(&(coarse / fine)),
        "{coarse:e} {fine:e}"
    );
}

#[test]
fn push_solves_the_rate_equation_for_a_linear_rate() {
    // Thesis: eq. (C.3), against many small steps of theta' = omega + theta x omega / 2
    let (from, to, dt_s) = (
        Vector3::new(1.0, -0.5, 0.3),
        Vector3::new(0.2, 0.8, -0.6),
        0.02,
    );
    let mut vector = bortz::RotationVector::starting(from);
    vector.push(to, dt_s);
    let (mut theta, steps) = (Vector3::zeros(), 2000);
    let h = dt_s / f64::from(steps);
    let at = |s: f64| from + (to - from) * s;
    for i in 0..steps {
        let middle = (f64::from(i) + 0.5) / f64::from(steps);
        let half = theta + bortz::rate(&theta, &at(middle)) * (0.5 * h);
        theta += bortz::rate(&half, &at(middle)) * h;
    }
    // terms of third order in the angle are left out: (0.02)^3 / 12
    assert!(
        (vector.theta() - theta).norm() < 1e-6,
        "{:e}",
        (vector.theta() - theta).norm()
    );
    let coning = vector.theta() - (from + to) * (0.5 * dt_s);
    assert!((coning - from.cross(&to) * (dt_s * dt_s / 12.0)).norm() < 1e-18);
}

fn samples(count: i64) -> Vec<ImuSample> {
    (0..count)
        .map(|i| ImuSample {
            stamp: Stamp::from_ns(i * 2_000_000),
            gyro_rad_s: omega(i as f64 * 2e-3),
            accel_m_s2: Vector3::zeros(),
        })
        .collect()
}

#[test]
fn rotation_between_samples_equals_the_true_rotation() {
    let rotation = bortz::rotation_between(&samples(1001)).unwrap();
    let error = so3::log(&(rotation.inverse() * truth(0.0).inverse() * truth(2.0))).norm();
    // rates taken as linear over h = 2 ms shrink the cone's angle by (Omega h)^2 / 12 = 5e-5, and the
    // turn of 0.29 rad that the coning makes in 2 s by twice that
    assert!(error < 4e-5, "{error:e}");
}

#[test]
fn rotation_between_rejects_too_few_unordered_and_unknown_samples() {
    let text = |samples: &[ImuSample]| bortz::rotation_between(samples).unwrap_err().to_string();
    assert!(text(&samples(1)).contains("at least 2"));
    assert!(text(&[]).contains("at least 2"));
    let mut swapped = samples(5);
    swapped.swap(2, 3);
    assert!(text(&swapped).contains("index 3"), "{}", text(&swapped));
    let mut unknown = samples(5);
    unknown[4].gyro_rad_s.y = f64::NAN;
    assert!(
        text(&unknown).starts_with("samples[4].gyro_rad_s:"),
        "{}",
        text(&unknown)
    );
}
