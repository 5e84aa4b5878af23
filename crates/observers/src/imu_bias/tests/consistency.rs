//! The covariance that the filter tells, against its errors: many recordings with biases drawn from
//! what the filter believes at the start.

use super::*;
use crate::imu_bias::kalman::{Vector12, stacked};

const RUNS: u64 = 40;
/// Of gravity at the start, m/s^2: the filter's own number.
const START_M_S2: f64 = 1.5;

/// Mean over the runs of the squared error in units of the covariance, per freedom, of all twelve
/// states, at the end.
fn normalised(motion: &Motion, seconds: f64) -> f64 {
    let mut sum = 0.0;
    for seed in 0..RUNS {
        let mut rng = ChaCha8Rng::seed_from_u64(1000 + seed);
        let mut normal = |sigma: f64| -> Vector3<f64> {
            Vector3::from_fn(|_, _| sigma * Distribution::<f64>::sample(&StandardNormal, &mut rng))
        };
        let config = ImuBiasConfig {
            gyro_sigma_rad_s: BEST_FLOW.gyro,
            accel_sigma_m_s2: BEST_FLOW.accel,
            // The biases of these recordings are constant.
            gyro_walk: 1e-8,
            accel_walk: 1e-7,
            gravity_m_s2: 9.81 + normal(0.005).x,
            ..ImuBiasConfig::default()
        };
        let (gyro, accel) = (
            normal(config.gyro_bias_sigma),
            normal(config.accel_bias_sigma),
        );
        let mut samples = samples(motion, seconds, 30.0, BEST_FLOW, seed);
        for s in &mut samples {
            s.gyro_rad_s += gyro - GYRO_BIAS;
            s.accel_m_s2 += accel - ACCEL_BIAS;
            s.mag = None;
        }
        // The first reading, which says where gravity is, is off by what the filter believes of it.
        samples[0].accel_m_s2 = normal(START_M_S2) - truth(motion, 0.0).gravity;
        let run = ImuBiasEstimator::new(config).unwrap().run(&samples);
        let state = run.states.last().unwrap();
        let truth = Kinematics {
            gyro_bias: gyro,
            accel_bias: accel,
            ..truth(motion, (samples.len() - 1) as f64 * DT_S)
        };
        let found = Kinematics {
            velocity: state.velocity_m_s,
            gravity: state.gravity_m_s2,
            gyro_bias: state.gyro_bias_rad_s,
            accel_bias: state.accel_bias_m_s2,
        };
        let error: Vector12 = stacked(&found) - stacked(&truth);
        let inverse = state.covariance.unwrap().try_inverse().unwrap();
        sum += error.dot(&(inverse * error)) / 12.0;
    }
    sum / RUNS as f64
}

/// 95 % of a chi square with 12 * 40 degrees of freedom, per degree, lies within 1 +- this.
const BOUND: f64 = 0.127;

#[test]
fn covariance_in_motion_that_shows_all_is_that_of_the_errors() {
    let found = normalised(&looking_around(), 20.0);
    println!("looking around: {found:.3} per freedom");
    assert!((found - 1.0).abs() < BOUND, "{found}");
}

#[test]
fn covariance_without_turning_is_that_of_the_errors() {
    let mut motion = looking_around();
    for curve in [
        &mut motion.yaw_rad,
        &mut motion.pitch_rad,
        &mut motion.roll_rad,
    ] {
        curve.waves.clear();
    }
    let found = normalised(&motion, 20.0);
    println!("without turning: {found:.3} per freedom");
    assert!((found - 1.0).abs() < BOUND, "{found}");
}
