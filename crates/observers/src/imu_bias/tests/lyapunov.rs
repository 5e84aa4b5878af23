//! The observer (7.4): its Lyapunov function falls, and it holds the published rate.

use super::*;

#[test]
fn lyapunov_function_without_noise_falls_on_every_step() {
    // Thesis: eq. (7.4). Thesis: section 7.3.
    // Thesis: eq. (7.5): the error's dynamics, with the corrected `v^ x omega_b~`.
    let motion = looking_around();
    let config = config(ImuBiasMethod::Observer);
    let mut observer = ImuBiasEstimator::new(config).unwrap();
    let samples = samples(&motion, 120.0, 200.0, EXACT, 0);
    let (mut last, mut first) = (f64::INFINITY, None);
    for (i, s) in samples.iter().enumerate() {
        observer.step(
            &s.gyro_rad_s,
            &s.accel_m_s2,
            s.velocity.as_ref(),
            s.mag.as_ref(),
            s.dt_s,
        );
        let estimate = &observer.kalman.x;
        let v = config
            .gains
            .lyapunov(estimate, &truth(&motion, i as f64 * DT_S));
        assert!(v < last, "step {i}: {last} -> {v}");
        first.get_or_insert(v);
        last = v;
    }
    let first = first.unwrap();
    assert!(last < 0.01 * first, "{first} -> {last}");
    println!(
        "(7.4): V {first:.3e} -> {last:.3e}, falling on each of {} steps",
        samples.len()
    );
}

#[test]
fn kinematics_of_the_body_reproduce_the_moving_truth() {
    // Thesis: eq. (7.1).
    let motion = Motion::hand_held(5);
    let mut x = truth(&motion, 0.0);
    let dt_s = 1e-3;
    for i in 0..2000 {
        let state = motion.state((i as f64 + 0.5) * dt_s);
        let body = state.world_from_camera.rotation.inverse();
        let accel = body * (state.accel_world_m_s2 - DOWN) + ACCEL_BIAS;
        x.step(&(state.twist.angular_rad_s + GYRO_BIAS), &accel, dt_s);
    }
    let expected = truth(&motion, 2.0);
    assert!((x.velocity - expected.velocity).norm() < 1e-5);
    assert!((x.gravity - expected.gravity).norm() < 1e-5);
}
