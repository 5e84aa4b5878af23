//! The observer (7.4) says how far it can have come: it has no covariance to say so.

use super::*;

/// Turns of `amplitude` rad about each axis, slowly, each at its own pace.
fn turning(amplitude: f64) -> Motion {
    let wave = |hz: f64| Curve::waves(0.0, [Wave::hz(amplitude, hz, 0.0)]);
    let mut motion = Motion::hand_held(3);
    motion.yaw_rad = wave(0.1);
    motion.pitch_rad = wave(0.13);
    motion.roll_rad = wave(0.07);
    motion
}

/// Error of the accelerometer's bias and status, each ten seconds of four minutes.
fn course(motion: &Motion, method: ImuBiasMethod, with_field: bool) -> Vec<(f64, Status)> {
    let samples = samples(motion, 240.0, 30.0, BEST_FLOW, 1);
    let mut config = config(method);
    config.field_dot_down = config.field_dot_down.filter(|_| with_field);
    let run = ImuBiasEstimator::new(config).unwrap().run(&samples);
    let at = |state: &ImuBiasState| ((state.accel_bias_m_s2 - ACCEL_BIAS).norm(), state.status);
    run.states.iter().skip(1999).step_by(2000).map(at).collect()
}

#[test]
fn observer_under_little_turning_never_says_ok() {
    // Thesis: Proposition 7, with noise: the bias wanders instead of converging.
    for amplitude in [0.0, 0.02, 0.1, 0.2] {
        for (error, status) in course(&turning(amplitude), ImuBiasMethod::Observer, false) {
            assert!(
                matches!(status, Status::Weak(Reason::Unobservable { .. })),
                "{amplitude} rad: {status} with {error} m/s^2"
            );
        }
    }
}

#[test]
fn observer_says_ok_only_where_it_has_converged() {
    // An eighth of the start's error of 0.143 m/s^2, and its ripple of 0.01.
    const CONVERGED: f64 = 0.028;
    let mut settled = 0;
    for (motion, with_field) in [
        (turning(0.4), false),
        (turning(0.4), true),
        (turning(0.8), false),
        (turning(0.8), true),
        (looking_around(), false),
        (looking_around(), true),
    ] {
        let course = course(&motion, ImuBiasMethod::Observer, with_field);
        for (error, status) in &course {
            assert!(
                *status != Status::Ok || *error < CONVERGED,
                "{status} with {error} m/s^2"
            );
        }
        settled += usize::from(course.last().unwrap().1 == Status::Ok);
    }
    assert!(settled >= 5, "{settled} of 6 settle within four minutes");
}

#[test]
fn filter_under_little_turning_says_weak_until_its_covariance_is_small() {
    for amplitude in [0.0, 0.02, 0.2] {
        let sigma = ImuBiasConfig::default().accel_bias_sigma;
        for (error, status) in course(&turning(amplitude), ImuBiasMethod::Ekf, false) {
            assert!(
                status != Status::Ok || error < 0.5 * sigma,
                "{amplitude} rad: {status} with {error} m/s^2"
            );
        }
    }
}
