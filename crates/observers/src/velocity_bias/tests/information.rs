//! The information form in the thesis's simulation.

use super::*;
use nalgebra::Matrix6;

#[test]
fn information_form_without_noise_is_there_within_a_second() {
    // Thesis: section 5.4.3. Thesis: eq. (5.1). Thesis: eq. (5.3).
    let errors = run(VelocityBiasConfig::default(), EXACT, 2.0, 0.5);
    let (angular, linear) = largest(&errors, 1.0);
    println!("information form, exact: {linear:.5} m/s, {angular:.2e} rad/s from 1 s on");
    assert!(linear < 0.003 && angular < 2e-4);
}

#[test]
fn information_form_with_the_noise_of_the_thesis_stays_within_centimetres_per_second() {
    // Thesis: section 5.4.3.
    let config = VelocityBiasConfig {
        linear_sigma: THESIS.linear,
        angular_sigma: THESIS.angular,
        ..VelocityBiasConfig::default()
    };
    let errors = run(config, THESIS, 8.0, 0.5);
    let (early, late) = (largest(&errors, 1.0), largest(&errors, 4.0));
    println!(
        "information form, noisy: from 1 s {:.4} m/s, {:.2e} rad/s; from 4 s {:.4}, {:.2e}",
        early.1, early.0, late.1, late.0
    );
    assert!(late.1 < 0.02 && late.0 < 0.004);
}

#[test]
fn pair_with_exact_readings_is_solved_at_once() {
    // Thesis: eq. (5.3).
    let mut sum = BiasInformation::new([1e3, 1e3], [1e-9, 1e-9], 1e9);
    let bias = Vector6::new(0.1, -0.2, 0.3, 1.0, 2.0, -1.0);
    let used = Vector6::new(0.0, 0.1, 0.0, 0.5, 0.0, 0.0);
    let information = Matrix6::from_fn(|i, j| if i == j { 4.0 } else { 0.3 }) * 100.0;
    let pair = PairInformation {
        information,
        gradient: information * (bias - used),
        bias_used: used,
    };
    sum.push(&pair, true, 0.01);
    assert!((sum.bias() - bias).norm() < 1e-5, "{:?}", sum.bias());
}

#[test]
fn unknown_linear_velocity_leaves_the_angular_bias() {
    let camera = camera(160, 120);
    let mut simulation = Simulation::new(&camera, EXACT);
    let mut estimator = VelocityBiasEstimator::new(&camera, VelocityBiasConfig::default()).unwrap();
    let mut state = estimator.state();
    for _ in 0..42 {
        let (grey, range, mut velocity, dt_s) = simulation.next();
        velocity.linear_m_s = None;
        state = estimator.step(&grey, &range, &velocity, dt_s).unwrap();
    }
    let off = (state.angular_rad_s - ANGULAR_BIAS).norm();
    assert!(off < 1e-3, "{off} rad/s");
    assert_eq!(state.linear_m_s, None);
}
