//! Bad samples: a status with a reason, and a state that stays finite.

use super::*;

#[test]
fn bad_samples_are_named_and_the_state_stays_finite() {
    let motion = looking_around();
    for method in [ImuBiasMethod::Ekf, ImuBiasMethod::Observer] {
        let mut samples = samples(&motion, 20.0, 30.0, BEST_FLOW, 1);
        samples[1000].gyro_rad_s.x = f64::NAN;
        samples[1001].accel_m_s2.z = f64::INFINITY;
        samples[1002].dt_s = 0.0;
        samples[1003].dt_s = -0.1;
        samples[2000].dt_s = 1.0;
        samples[1500].mag = Some(Vector3::repeat(f64::NAN));
        if let Some(velocity) = &mut samples[1400].velocity {
            velocity.linear_m_s.x = f64::NAN;
        }
        let run = ImuBiasEstimator::new(config(method)).unwrap().run(&samples);
        for (i, state) in run.states.iter().enumerate() {
            let parts = [
                state.velocity_m_s,
                state.gravity_m_s2,
                state.gyro_bias_rad_s,
                state.accel_bias_m_s2,
            ];
            assert!(parts.iter().flatten().all(|v| v.is_finite()), "sample {i}");
        }
        let reason = |i: usize| run.states[i].status.reason();
        assert_eq!(
            reason(1000),
            Some(Reason::NotFinite {
                sensor: Sensor::Gyro
            })
        );
        assert_eq!(
            reason(1001),
            Some(Reason::NotFinite {
                sensor: Sensor::Accel
            })
        );
        assert_eq!(reason(1002), Some(Reason::StampNotIncreasing));
        assert_eq!(reason(1003), Some(Reason::StampNotIncreasing));
        assert_eq!(reason(2000), Some(Reason::Gap { seconds: 1.0 }));
    }
}

#[test]
fn velocity_far_off_is_gated() {
    let motion = looking_around();
    let mut samples = samples(&motion, 20.0, 30.0, BEST_FLOW, 1);
    let wrong = (3000..4000)
        .find(|i| samples[*i].velocity.is_some())
        .unwrap();
    if let Some(velocity) = &mut samples[wrong].velocity {
        velocity.linear_m_s.x += 1.0;
    }
    let run = ImuBiasEstimator::new(config(ImuBiasMethod::Ekf))
        .unwrap()
        .run(&samples);
    assert!(matches!(
        run.states[wrong].status,
        Status::Weak(Reason::Gated {
            sensor: Sensor::Velocity,
            ..
        })
    ));
    let jump = run.states[wrong].accel_bias_m_s2 - run.states[wrong - 1].accel_bias_m_s2;
    assert!(jump.norm() < 1e-3);
}

#[test]
fn accelerometer_in_g_and_lost_velocity_are_told() {
    let motion = looking_around();
    let mut samples = samples(&motion, 10.0, 30.0, BEST_FLOW, 1);
    for s in &mut samples {
        s.accel_m_s2 /= 9.81;
    }
    let mut filter = ImuBiasEstimator::new(config(ImuBiasMethod::Observer)).unwrap();
    let status = filter.run(&samples).states.last().unwrap().status;
    assert!(status.to_string().contains("given in g"), "{status}");
    let quiet: Vec<ImuBiasSample> = super::samples(&motion, 3.0, 0.1, BEST_FLOW, 1);
    let run = ImuBiasEstimator::new(config(ImuBiasMethod::Ekf))
        .unwrap()
        .run(&quiet);
    assert!(matches!(
        run.states.last().unwrap().status,
        Status::Weak(Reason::Coasting { .. })
    ));
    let bad = ImuBiasConfig {
        gravity_m_s2: f64::NAN,
        ..ImuBiasConfig::default()
    };
    assert!(
        ImuBiasEstimator::new(bad)
            .unwrap_err()
            .to_string()
            .contains("gravity_m_s2")
    );
}
