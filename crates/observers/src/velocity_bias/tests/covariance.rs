//! The covariance that the information form tells, against its errors: many recordings.

use super::*;
use nalgebra::Matrix6;

/// Errors squared in units of their covariance, per degree of freedom: [all, angular, linear] at
/// each second of a recording.
fn normalised_errors(seed: u64, noise: Noise, seconds: usize) -> Vec<[f64; 3]> {
    let camera = camera(160, 120);
    let mut simulation = Simulation::new(&camera, noise);
    simulation.rng = ChaCha8Rng::seed_from_u64(seed);
    // Another path of the same hand.
    simulation.index = 1000 * seed as usize;
    let config = VelocityBiasConfig {
        linear_sigma: noise.linear,
        angular_sigma: noise.angular,
        // The biases are constant: forgetting would be doubt about nothing.
        forget_s: 100.0,
        // Neither lens nor blur: what is left is interpolation.
        shared_error_px: 0.03,
        ..VelocityBiasConfig::default()
    };
    let mut estimator = VelocityBiasEstimator::new(&camera, config).unwrap();
    let mut found = Vec::new();
    for i in 1..=seconds * RATE_HZ as usize {
        let (grey, range, velocity, dt_s) = simulation.next();
        let state = estimator.step(&grey, &range, &velocity, dt_s).unwrap();
        if !i.is_multiple_of(RATE_HZ as usize) {
            continue;
        }
        let p: Matrix6<f64> = state.covariance.unwrap();
        let angular = state.angular_rad_s - ANGULAR_BIAS;
        let linear = state.linear_m_s.unwrap() - LINEAR_BIAS;
        let mut error = Vector6::zeros();
        error.fixed_rows_mut::<3>(0).copy_from(&angular);
        error.fixed_rows_mut::<3>(3).copy_from(&linear);
        let part = |start: usize, e: &Vector3<f64>| {
            let p = p.fixed_view::<3, 3>(start, start).into_owned();
            e.dot(&(p.try_inverse().unwrap() * e)) / 3.0
        };
        let all = error.dot(&(p.try_inverse().unwrap() * error)) / 6.0;
        found.push([all, part(0, &angular), part(3, &linear)]);
    }
    found
}

#[test]
fn covariance_of_the_biases_is_that_of_their_errors() {
    // Thesis: section 5.4.3, the noise.
    let mut sums = [[0.0; 3]; 4];
    const SEEDS: u64 = 24;
    for seed in 0..SEEDS {
        for (sum, at) in sums.iter_mut().zip(normalised_errors(seed, THESIS, 4)) {
            for (sum, value) in sum.iter_mut().zip(at) {
                *sum += value / SEEDS as f64;
            }
        }
    }
    for (i, [all, angular, linear]) in sums.iter().enumerate() {
        println!(
            "after {} s: error squared per freedom {all:.2} ({angular:.2} angular, {linear:.2} linear)",
            i + 1
        );
    }
    for (i, means) in sums.iter().enumerate() {
        for mean in means {
            assert!((0.5..2.0).contains(mean), "{means:?} after {} s", i + 1);
        }
    }
}
