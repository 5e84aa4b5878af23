//! The information form in the thesis's simulation.

use super::*;
use nalgebra::Matrix6;
use sphereflow_sphere::lie::se3;

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
    assert!(early.1 < 0.02 && early.0 < 0.004);
}

/// A filter with next to exact readings, that has turned and moved for a second by `measured`.
fn alignments(bias: &Vector6<f64>, steps: usize) -> BiasInformation {
    let mut known = BiasInformation::new(BiasPrior {
        start: [1.0, 3.0],
        reading: [1e-6, 1e-6],
        forget_s: 1e9,
    });
    let twist = Vector6::new(0.3, -0.2, 0.5, 0.4, 0.1, -0.3);
    for i in 1..=steps {
        known.predict(&(twist + bias), true, 0.01);
        // An exact alignment says where the camera is: the twist from the prediction to the truth.
        let truth = se3::exp(&(twist * (0.01 * i as f64)));
        let xi = se3::log(&(known.pose().inverse() * truth));
        let information = Matrix6::from_fn(|i, j| if i == j { 4.0 } else { 0.3 }) * 1e8;
        let found = PoseInformation {
            information,
            gradient: Vector6::zeros(),
        };
        known
            .correct(&xi, &found, &Matrix6::zeros(), f64::INFINITY)
            .unwrap();
    }
    known
}

#[test]
fn bias_of_exact_readings_and_alignments_is_found() {
    // Thesis: eq. (5.1).
    let bias = Vector6::new(0.1, -0.2, 0.3, 1.0, 2.0, -1.0);
    let known = alignments(&bias, 100);
    let off = (known.bias() - bias).norm();
    // Poses known to 5e-5 over a second.
    assert!(off < 1e-4, "{off}: {:?}", known.bias());
    assert!(known.covariance().diagonal().max() < 1e-7);
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
