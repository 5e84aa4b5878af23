//! Bad images and velocities: a status with a reason, or an error that names the argument.

use super::*;

#[test]
fn images_of_the_wrong_size_are_an_error_that_names_them() {
    let camera = camera(160, 120);
    let mut estimator = VelocityBiasEstimator::new(&camera, VelocityBiasConfig::default()).unwrap();
    let (grey, range) = (
        Plane::filled(160, 120, 1.0),
        RangeMap::new(Plane::filled(80, 60, 1.0)),
    );
    let velocity = ImageVelocity {
        angular_rad_s: Vector3::zeros(),
        linear_m_s: None,
    };
    let error = estimator
        .step(&grey, &range, &velocity, 0.02)
        .unwrap_err()
        .to_string();
    assert!(error.contains("range"), "{error}");
}

#[test]
fn unknown_images_and_bad_numbers_are_skipped_and_the_biases_stay_finite() {
    let camera = camera(160, 120);
    for method in [
        BiasMethod::Information,
        BiasMethod::Observer,
        BiasMethod::Normalised,
    ] {
        let mut simulation = Simulation::new(&camera, EXACT);
        let config = VelocityBiasConfig {
            method,
            ..VelocityBiasConfig::default()
        };
        let mut estimator = VelocityBiasEstimator::new(&camera, config).unwrap();
        for i in 0..8 {
            let (mut grey, mut range, mut velocity, mut dt_s) = simulation.next();
            match i {
                2 => range = RangeMap::new(Plane::filled(160, 120, f32::NAN)),
                3 => velocity.angular_rad_s.x = f64::NAN,
                4 => dt_s = 0.0,
                5 => grey = Plane::filled(160, 120, f32::NAN),
                6 => grey.data_mut()[..9000].fill(f32::NAN),
                _ => {}
            }
            let state = estimator.step(&grey, &range, &velocity, dt_s).unwrap();
            match i {
                2 => assert!(matches!(
                    state.status,
                    Status::Skipped(Reason::FewPixels { .. })
                )),
                3 => assert_eq!(
                    state.status,
                    Status::Skipped(Reason::NotFinite {
                        sensor: Sensor::Velocity
                    })
                ),
                4 => assert_eq!(state.status, Status::Skipped(Reason::StampNotIncreasing)),
                _ => {}
            }
            assert!(
                state.angular_rad_s.iter().all(|v| v.is_finite()),
                "{method:?} {i}"
            );
        }
    }
}

#[test]
fn view_of_a_sphere_names_its_blind_rotations() {
    // Thesis: Theorem 3.
    let camera = Camera::equirectangular(96, 48).unwrap();
    let config = VelocityBiasConfig::default();
    let mut estimator = VelocityBiasEstimator::new(&camera, config).unwrap();
    let (grey, range) = (
        Plane::filled(96, 48, 100.0),
        RangeMap::new(Plane::filled(96, 48, 3.0)),
    );
    let velocity = ImageVelocity {
        angular_rad_s: Vector3::zeros(),
        linear_m_s: Some(Vector3::zeros()),
    };
    let mut state = estimator.state();
    for _ in 0..3 {
        state = estimator.step(&grey, &range, &velocity, 0.02).unwrap();
    }
    assert_eq!(
        state.status,
        Status::Weak(Reason::Unobservable { directions: 3 })
    );
    for direction in &state.blind_directions {
        assert!(direction.fixed_rows::<3>(3).norm() < 1e-3, "{direction:?}");
    }
    let bad = VelocityBiasConfig {
        forget_s: 0.0,
        ..config
    };
    assert!(
        VelocityBiasEstimator::new(&camera, bad)
            .unwrap_err()
            .to_string()
            .contains("forget_s")
    );
}
