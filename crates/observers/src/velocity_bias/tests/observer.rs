//! The observers (5.16), (5.33), (5.34): Lyapunov decrease, signs, rates.

use super::*;

/// Period of the paint, m: that of slow gradients, for which the printed gains were chosen.
const PERIOD_M: f64 = 2.0;

fn observer(gains: FixedGains) -> VelocityBiasConfig {
    VelocityBiasConfig {
        method: BiasMethod::Observer,
        gains,
        ..VelocityBiasConfig::default()
    }
}

/// Values of the Lyapunov function after each frame.
fn lyapunov(
    camera: &Camera,
    config: VelocityBiasConfig,
    frames: usize,
    rotation_only: bool,
) -> Vec<f64> {
    let mut simulation = Simulation::painted(camera, EXACT, PERIOD_M);
    let mut truth = true_bias();
    if rotation_only {
        for curve in &mut simulation.motion.position_m {
            curve.waves.clear();
        }
        truth.fixed_rows_mut::<3>(3).fill(0.0);
    }
    let mut estimator = VelocityBiasEstimator::new(camera, config).unwrap();
    let step = |_| {
        let (grey, range, mut velocity, dt_s) = simulation.next();
        if rotation_only {
            velocity.linear_m_s = None;
        }
        estimator.step(&grey, &range, &velocity, dt_s).unwrap();
        estimator.lyapunov(&truth).unwrap()
    };
    (0..frames).map(step).collect()
}

/// V is sums of pictures: a rise below a thousandth is the floor of the transport.
const RISE: f64 = 1.001;

fn rises(values: &[f64]) -> usize {
    values.windows(2).filter(|w| w[1] > w[0] * RISE).count()
}

#[test]
fn observer_on_a_cap_has_a_falling_lyapunov_function() {
    // Thesis: eq. (5.33), with phi in the linear bias's source. Thesis: eq. (5.17). Thesis: eq. (5.18).
    let values = lyapunov(
        &camera(160, 120),
        observer(FixedGains::default()),
        210,
        false,
    );
    let (first, last) = (values[1], values[209]);
    println!(
        "(5.33): V {first:.3e} -> {last:.3e}, {} of 208 steps rose",
        rises(&values[1..])
    );
    // Of the 437 at the start 125 are the angular bias's, which the printed k_omega hardly moves.
    assert!(last < 0.35 * first, "{first} -> {last}");
    assert!(rises(&values[1..]) < 20);
}

#[test]
fn observer_on_the_whole_sphere_finds_the_linear_bias_with_the_printed_gains() {
    // Thesis: eq. (5.16). Thesis: eq. (5.2). That V falls on every step is shown where nothing has an
    // edge; here the edges between walls leave a floor.
    let camera = Camera::equirectangular(128, 64).unwrap();
    let mut simulation = Simulation::painted(&camera, EXACT, PERIOD_M);
    let config = observer(FixedGains::default());
    let mut estimator = VelocityBiasEstimator::new(&camera, config).unwrap();
    let mut off = Vec::new();
    for _ in 0..168 {
        let (grey, range, velocity, dt_s) = simulation.next();
        let state = estimator.step(&grey, &range, &velocity, dt_s).unwrap();
        off.push((state.linear_m_s.unwrap() - LINEAR_BIAS).norm());
    }
    println!(
        "(5.16): {:.3} m/s after 2 s, {:.3} after 4 s",
        off[83], off[167]
    );
    assert!(off[83] < 0.1 && off[167] < 0.05);
}

#[test]
fn observer_of_a_turning_camera_has_a_falling_lyapunov_function() {
    // Thesis: eq. (5.34).
    let gains = FixedGains {
        k_omega: 1e-4,
        ..FixedGains::default()
    };
    let values = lyapunov(&camera(160, 120), observer(gains), 210, true);
    let (first, last) = (values[1], values[209]);
    println!(
        "(5.34): V {first:.3e} -> {last:.3e}, {} of 208 steps rose",
        rises(&values[1..])
    );
    assert!(last < 0.1 * first, "{first} -> {last}");
}

#[test]
fn normalised_observer_converges_at_its_rate_in_any_scene() {
    // Thesis: eq. (5.33), gains times the inverse Gram matrix.
    let config = VelocityBiasConfig {
        method: BiasMethod::Normalised,
        ..VelocityBiasConfig::default()
    };
    let errors = run(config, EXACT, 14.0, PERIOD_M);
    let (angular, linear) = largest(&errors, 13.0);
    println!("normalised: {linear:.4} m/s, {angular:.2e} rad/s after 13 s");
    assert!(linear < 0.05 && angular < 0.02);
}

#[test]
fn window_is_smooth_and_one_inside() {
    // Thesis: section 5.4.1.
    let grid = SphereGrid::new(&camera(160, 120)).unwrap();
    let window = Window::new(&grid, 0.15).unwrap();
    assert_eq!(window.at(&Vector2::new(79.5, 59.5)), 1.0);
    assert_eq!(window.values()[0], 0.0);
    assert!(window.gradient()[0].norm() == 0.0);
    assert!(window.values().iter().all(|v| (0.0..=1.0).contains(v)));
}
