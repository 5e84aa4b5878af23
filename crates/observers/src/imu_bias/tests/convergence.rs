//! What observer, filter, loops and smoother reach over two minutes with noise.

use super::*;

struct Errors {
    accel: f64,
    gyro: f64,
    velocity: f64,
    gravity_deg: f64,
}

/// Root mean squares over the second half, of the states of a run.
fn errors(run: &ImuBiasRun, motion: &Motion) -> Errors {
    let (mut sums, mut count) = ([0.0; 4], 0.0);
    let half = run.samples.last().unwrap() / 2;
    for (state, sample) in run.states.iter().zip(&run.samples) {
        if *sample < half {
            continue;
        }
        let truth = truth(motion, *sample as f64 * DT_S);
        sums[0] += (state.accel_bias_m_s2 - ACCEL_BIAS).norm_squared();
        sums[1] += (state.gyro_bias_rad_s - GYRO_BIAS).norm_squared();
        sums[2] += (state.velocity_m_s - truth.velocity).norm_squared();
        sums[3] += state
            .gravity_m_s2
            .angle(&truth.gravity)
            .to_degrees()
            .powi(2);
        count += 1.0;
    }
    let [accel, gyro, velocity, gravity_deg] = sums.map(|s: f64| f64::sqrt(s / count));
    let errors = Errors {
        accel,
        gyro,
        velocity,
        gravity_deg,
    };
    // for the table: cargo test -- --nocapture
    println!("{accel:.4} m/s^2, {gyro:.2e} rad/s, {velocity:.4} m/s, {gravity_deg:.3} deg");
    errors
}

#[test]
fn observer_over_two_minutes_reaches_the_published_biases() {
    // Thesis: eq. (7.4).
    let motion = looking_around();
    let samples = samples(&motion, 120.0, 30.0, BEST_FLOW, 1);
    let run = ImuBiasEstimator::new(config(ImuBiasMethod::Observer))
        .unwrap()
        .run(&samples);
    let e = errors(&run, &motion);
    assert!(e.accel < 0.012 && e.gyro < 5e-4 && e.gravity_deg < 0.15);
}

#[test]
fn filter_over_two_minutes_is_several_times_better_than_the_observer() {
    let motion = looking_around();
    let samples = samples(&motion, 120.0, 30.0, BEST_FLOW, 1);
    let run = ImuBiasEstimator::new(config(ImuBiasMethod::Ekf))
        .unwrap()
        .run(&samples);
    let e = errors(&run, &motion);
    assert!(e.accel < 0.003 && e.gyro < 1e-4 && e.gravity_deg < 0.15);
    assert!(e.velocity < 0.01);
    assert_eq!(run.states.last().unwrap().status, Status::Ok);
}

#[test]
fn smoother_knows_the_biases_from_the_start() {
    let motion = looking_around();
    let samples = samples(&motion, 30.0, 30.0, BEST_FLOW, 2);
    let forward = ImuBiasEstimator::new(config(ImuBiasMethod::Ekf))
        .unwrap()
        .run(&samples);
    let smooth = ImuBiasEstimator::smooth(config(ImuBiasMethod::Ekf), &samples).unwrap();
    let off = |state: &ImuBiasState| {
        (
            (state.gyro_bias_rad_s - GYRO_BIAS).norm(),
            (state.accel_bias_m_s2 - ACCEL_BIAS).norm(),
        )
    };
    let (early, late) = (off(&forward.states[200]), off(&smooth.states[30]));
    assert!(late.0 < 2e-4 && late.1 < 0.006, "{late:?}");
    assert!(
        late.0 < early.0 && late.1 < 0.2 * early.1,
        "{early:?} {late:?}"
    );
    errors(&smooth, &motion);
}

#[test]
fn loops_over_a_short_recording_bring_the_observer_further() {
    // Thesis: section 7.7.
    let motion = looking_around();
    let samples = samples(&motion, 20.0, 30.0, BEST_FLOW, 3);
    let off = |times: usize| {
        let run =
            ImuBiasEstimator::loops(config(ImuBiasMethod::Observer), &samples, times).unwrap();
        (run.states.last().unwrap().accel_bias_m_s2 - ACCEL_BIAS).norm()
    };
    let (once, often) = (off(1), off(15));
    assert!(often < 0.6 * once, "{once} -> {often}");
}
