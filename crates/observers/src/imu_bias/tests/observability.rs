//! Thesis: Proposition 7. Blind directions are named, and it is there that nothing is learnt.

use super::*;

/// A body that turns about its own z axis (the optical axis) alone, and sways.
fn about_one_axis(turns: bool) -> Motion {
    let mut motion = Motion::hand_held(3);
    let still = Curve::default();
    (motion.yaw_rad, motion.pitch_rad) = (still.clone(), still.clone());
    motion.roll_rad = if turns {
        Curve::waves(0.0, [Wave::hz(0.5, 0.2, 0.0)])
    } else {
        still
    };
    motion
}

fn final_error(
    motion: &Motion,
    field_dot_down: Option<f64>,
    field: &Vector3<f64>,
) -> (Vector3<f64>, ImuBiasEstimator) {
    let mut samples = samples(motion, 60.0, 30.0, BEST_FLOW, 4);
    for (i, s) in samples.iter_mut().enumerate() {
        let body = motion
            .state(i as f64 * DT_S)
            .world_from_camera
            .rotation
            .inverse();
        s.mag = Some(body * field);
    }
    let config = ImuBiasConfig {
        field_dot_down,
        // The norm of gravity would tell one blind direction.
        gravity_sigma_m_s2: 10.0,
        ..config(ImuBiasMethod::Ekf)
    };
    let mut filter = ImuBiasEstimator::new(config).unwrap();
    let run = filter.run(&samples);
    (
        run.states.last().unwrap().accel_bias_m_s2 - ACCEL_BIAS,
        filter,
    )
}

#[test]
fn fixed_axis_orthogonal_to_the_field_is_blind_along_that_axis() {
    // Thesis: Proposition 7. Thesis: eq. (7.2).
    let motion = about_one_axis(true);
    let field = Vector3::y(); // straight down: orthogonal to the optical axis
    let (error, filter) = final_error(&motion, Some(1.0), &field);
    let blind = filter.excitation().blind_directions();
    assert_eq!(blind.len(), 1);
    assert!(blind[0].z.abs() > 0.999, "{blind:?}");
    assert_eq!(
        filter.state().status,
        Status::Weak(Reason::Unobservable { directions: 1 })
    );
    // Along the axis the filter knows no more than at the start, and says so; across it, it does.
    let covariance = filter.state().covariance.unwrap();
    let sigma = |i: usize| covariance[(9 + i, 9 + i)].sqrt();
    assert!(
        sigma(2) > 0.75 * filter.config().accel_bias_sigma,
        "{}",
        sigma(2)
    );
    assert!(sigma(0) < 0.01 && sigma(1) < 0.01);
    assert!(error.xy().norm() < 0.02, "{error:?}");
}

#[test]
fn fixed_axis_along_the_field_is_observable() {
    // Thesis: Proposition 7. Thesis: eq. (7.3), second condition.
    let motion = about_one_axis(true);
    let (error, filter) = final_error(&motion, Some(0.0), &Vector3::z());
    assert!(filter.excitation().blind_directions().is_empty());
    assert!(error.norm() < 0.02, "{error:?}");
}

#[test]
fn turning_axis_is_observable_without_a_field() {
    // Thesis: eq. (7.3), first condition.
    let (error, filter) = final_error(&Motion::hand_held(3), None, &Vector3::z());
    assert!(filter.excitation().blind_directions().is_empty());
    assert!(error.norm() < 0.02, "{error:?}");
}

#[test]
fn no_rotation_without_field_is_blind_in_all_directions() {
    // Thesis: Proposition 7.
    let (error, filter) = final_error(&about_one_axis(false), None, &Vector3::z());
    assert_eq!(filter.excitation().blind_directions().len(), 3);
    let covariance = filter.state().covariance.unwrap();
    assert!(
        (0..3).all(|i| covariance[(9 + i, 9 + i)].sqrt() > 0.25),
        "{error:?}"
    );
}
