//! Single readings of any size, gaps of a day, and an hour of flaws of any size.

use super::*;
use crate::flaws::Flaws;
use crate::kalman::is_sound;

const METHODS: [ImuBiasMethod; 2] = [ImuBiasMethod::Ekf, ImuBiasMethod::Observer];

/// A spike below what is held back turns gravity by 2 rad/s * 5 ms = 0.6 degrees.
const SPIKE_DEG: f64 = 0.6;
/// What follows from it in the accelerometer's bias, m/s^2: 9.81 * 0.6 degrees, not all of it.
const SPIKE_M_S2: f64 = 0.06;

#[test]
fn spike_of_any_size_hardly_moves_gravity_and_biases() {
    let motion = looking_around();
    let clean = samples(&motion, 40.0, 30.0, BEST_FLOW, 1);
    for method in METHODS {
        let reference = ImuBiasEstimator::new(config(method)).unwrap().run(&clean);
        for (which, size) in [
            (0, 1.5),
            (0, 30.0),
            (0, 200.0),
            (0, 1e160),
            (1, 20.0),
            (1, 1e3),
            (1, 1e300),
            (2, 2.0),
            (2, 50.0),
            (2, 1e200),
            (3, 1e12),
        ] {
            let mut spoilt = clean.clone();
            let at = (4000..).find(|i| clean[*i].velocity.is_some()).unwrap();
            let s = &mut spoilt[at];
            match which {
                0 => s.gyro_rad_s.y += size,
                1 => s.accel_m_s2.y += size,
                2 => s.velocity.as_mut().unwrap().linear_m_s.y += size,
                _ => s.mag.as_mut().unwrap().y += size,
            }
            let run = ImuBiasEstimator::new(config(method)).unwrap().run(&spoilt);
            let what = format!("{method:?}, {which}, {size:e}");
            for (a, b) in reference.states.iter().zip(&run.states).skip(at) {
                let turned = a.gravity_m_s2.angle(&b.gravity_m_s2).to_degrees();
                assert!(turned < SPIKE_DEG, "{what}: {turned} deg");
                let bias = (a.accel_bias_m_s2 - b.accel_bias_m_s2).norm();
                assert!(bias < SPIKE_M_S2, "{what}: {bias} m/s^2");
            }
        }
    }
}

fn check(state: &ImuBiasState, what: &str) {
    if let Some(covariance) = &state.covariance {
        assert!(is_sound(covariance), "{what}: {covariance}");
    }
    let vectors = [
        state.velocity_m_s,
        state.gravity_m_s2,
        state.gyro_bias_rad_s,
        state.accel_bias_m_s2,
    ];
    assert!(vectors.iter().flatten().all(|v| v.is_finite()), "{what}");
}

#[test]
fn hour_of_flaws_of_any_size_leaves_a_positive_covariance() {
    let motion = looking_around();
    let minute = samples(&motion, 60.0, 30.0, BEST_FLOW, 2);
    for (method, seed) in [(ImuBiasMethod::Ekf, 4), (ImuBiasMethod::Observer, 5)] {
        let mut estimator = ImuBiasEstimator::new(config(method)).unwrap();
        let mut flaws = Flaws::new(seed, 0.02);
        for i in 0..720_000 {
            let mut s = minute[i % minute.len()];
            flaws.vector(&mut s.gyro_rad_s);
            flaws.vector(&mut s.accel_m_s2);
            if let Some(velocity) = &mut s.velocity {
                flaws.vector(&mut velocity.linear_m_s);
                if let Some(omega) = &mut velocity.angular_rad_s {
                    flaws.vector(omega);
                }
                if flaws.strikes() {
                    velocity.linear_covariance *= flaws.number();
                }
                if flaws.strikes() {
                    velocity.angular_covariance[(0, 1)] = flaws.number();
                }
            }
            if let Some(mag) = &mut s.mag {
                flaws.vector(mag);
            }
            let (velocity, mag) = (s.velocity.as_ref(), s.mag.as_ref());
            let dt_s = flaws.step(s.dt_s);
            let state = estimator.step(&s.gyro_rad_s, &s.accel_m_s2, velocity, mag, dt_s);
            if i % 10 == 0 {
                check(&state, &format!("{method:?}, sample {i}"));
            }
        }
        assert!(estimator.refused() > 10_000, "{}", estimator.refused());
    }
}

#[test]
fn hour_without_velocities_leaves_a_positive_covariance() {
    let motion = looking_around();
    let minute = samples(&motion, 60.0, 30.0, BEST_FLOW, 3);
    let mut estimator = ImuBiasEstimator::new(config(ImuBiasMethod::Ekf)).unwrap();
    for i in 0..720_000 {
        let s = &minute[i % minute.len()];
        let velocity = s.velocity.as_ref().filter(|_| i < 1000);
        let state = estimator.step(&s.gyro_rad_s, &s.accel_m_s2, velocity, None, s.dt_s);
        if i % 1000 == 0 {
            check(&state, &format!("sample {i}"));
        }
    }
}
