//! The invariant observer: its Lyapunov function falls, its errors do not depend on the attitude.

use super::super::invariant::InvariantObserver;
use super::*;

/// V = |theta|^2 / 2 + |b|^2 / 2 n with the error's rotation vector theta.
fn lyapunov(observer: &InvariantObserver, body: &Body, bias_gain: f64) -> f64 {
    let angle = observer.rotation().angle_to(&body.rotation);
    0.5 * angle * angle + (observer.bias() - body.bias).norm_squared() / (2.0 * bias_gain)
}

#[test]
fn invariant_observer_from_afar_converges_and_its_lyapunov_function_falls() {
    // Thesis: section 9.4.
    let config = AttitudeConfig::default();
    // A turning body shows its bias slower: n k / (k^2 + omega^2) instead of about k / 2.
    for (moves, seconds, left) in [(false, 120, 1e-6), (true, 400, 0.02)] {
        let (mut body, mut observer) = (
            Body::new([0.01, -0.02, 0.015], 0.0),
            InvariantObserver::new(&config),
        );
        let start = so3::exp(&Vector3::new(0.1, -0.1, 0.15)) * body.rotation;
        observer.set(start, Vector3::zeros());
        let first = lyapunov(&observer, &body, config.invariant_bias_gain);
        let mut last = first;
        for second in 0..seconds {
            for _ in 0..200 {
                let [gyro, accel, mag] = body.step(moves);
                observer.step(&gyro, &accel, Some(&mag), DT_S);
            }
            let now = lyapunov(&observer, &body, config.invariant_bias_gain);
            assert!(
                now <= last * (1.0 + 1e-3) + 1e-12,
                "{last} -> {now} at {second} s"
            );
            last = now;
        }
        assert!(last < left * first, "moves {moves}: {first} -> {last}");
    }
}

#[test]
fn invariant_observer_error_does_not_depend_on_the_heading() {
    // Thesis: section 9.4. Invariance: body, field and estimate turned about the vertical by the
    // same angle see the same errors.
    let config = AttitudeConfig::default();
    let mut biases = Vec::new();
    for angle in [0.0, 1.1] {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        let (mut body, mut observer) = (
            Body::new([0.01, -0.02, 0.015], 0.0),
            InvariantObserver::new(&config),
        );
        let start = so3::exp(&Vector3::new(0.1, -0.1, 0.15)) * body.rotation;
        body.rotation = turn * body.rotation;
        observer.set(turn * start, Vector3::zeros());
        for _ in 0..400 {
            let [gyro, accel, mag] = body.step(true);
            observer.step(&gyro, &accel, Some(&mag), DT_S);
        }
        biases.push(observer.bias());
    }
    let apart = (biases[0] - biases[1]).norm();
    // The error of the heading is not that of the whole turned rotation: small angles only.
    assert!(
        apart < 0.1 * biases[0].norm(),
        "{apart} of {}",
        biases[0].norm()
    );
}
