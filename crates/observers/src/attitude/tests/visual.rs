//! The observer with visual attitudes: its rate, its norm, its indifference to signs.

use super::*;

#[test]
fn visual_observer_error_decays_at_the_gain_whatever_the_sign_of_the_visual_attitude() {
    // Thesis: eq. (9.2). Thesis: eq. (9.3). Thesis: eq. (9.4): the printed rate is K/2; it is K.
    let gain = 2.0;
    for flips in [false, true] {
        let (mut body, mut observer) =
            (Body::new([0.0; 3], 0.0), VisualAttitude::new(gain).unwrap());
        let start = body.rotation * so3::exp(&Vector3::new(0.02, -0.03, 0.01));
        observer.step(&Vector3::zeros(), Some(&start), DT_S);
        let error = |o: &VisualAttitude, b: &Body| o.rotation().unwrap().angle_to(&b.rotation);
        let first = error(&observer, &body);
        let mut last = first;
        for i in 0..200 {
            let [gyro, ..] = body.step(true);
            let mut seen = body.rotation;
            if flips && i % 2 == 0 {
                seen = UnitQuaternion::new_unchecked(-seen.into_inner());
            }
            observer.step(&gyro, Some(&seen), DT_S);
            // V = |xi|^2
            let now = error(&observer, &body);
            assert!(now < last, "step {i}: {last} -> {now}");
            last = now;
        }
        let rate = (first / error(&observer, &body)).ln() / (200.0 * DT_S);
        // sin against the angle: second order in the error.
        assert!((rate / gain - 1.0).abs() < 5e-3, "{rate}, flips {flips}");
    }
}

#[test]
fn visual_observer_with_half_a_degree_of_noise_stays_below_a_tenth() {
    // Thesis: eq. (9.2).
    let (mut body, mut observer) = (Body::new([0.0; 3], 0.0), VisualAttitude::new(0.5).unwrap());
    let (mut sum, mut count) = (0.0, 0.0);
    for i in 0..8000 {
        let [gyro, ..] = body.step(true);
        let noise = body.normal() * 0.5_f64.to_radians();
        let mut seen = body.rotation * so3::exp(&noise);
        if i % 3 == 0 {
            seen = UnitQuaternion::new_unchecked(-seen.into_inner());
        }
        observer.step(&gyro, Some(&seen), DT_S);
        if i > 4000 {
            sum += observer
                .rotation()
                .unwrap()
                .angle_to(&body.rotation)
                .powi(2);
            count += 1.0;
        }
    }
    let rms = f64::sqrt(sum / count).to_degrees();
    assert!(rms < 0.1, "{rms} deg");
    assert!((observer.rotation().unwrap().norm() - 1.0).abs() < 1e-12);
}

#[test]
fn visual_observer_without_vision_coasts_and_says_so() {
    let mut observer = VisualAttitude::new(2.0).unwrap();
    let status = observer.step(&Vector3::x(), None, DT_S);
    assert_eq!(
        (status, observer.rotation()),
        (Status::Starting(Reason::NoData), None)
    );
    observer.step(&Vector3::x(), Some(&UnitQuaternion::identity()), DT_S);
    let mut status = Status::Ok;
    for _ in 0..200 {
        status = observer.step(&Vector3::x(), None, DT_S);
    }
    assert!(
        matches!(status, Status::Weak(Reason::Coasting { .. })),
        "{status}"
    );
    let angle = observer.rotation().unwrap().angle();
    assert!((angle - 1.0).abs() < 1e-9, "{angle}");
    let nan = observer.step(&Vector3::repeat(f64::NAN), None, DT_S);
    assert_eq!(
        nan,
        Status::Skipped(Reason::NotFinite {
            sensor: Sensor::Gyro
        })
    );
    assert!(VisualAttitude::new(-1.0).is_err());
}
