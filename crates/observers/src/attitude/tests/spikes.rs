//! Single readings of any size, and an hour of flaws of any size.

use super::*;
use crate::flaws::Flaws;

/// One spike below what is held back, of one sample of 5 ms, turns the attitude by
/// (1 + 200 * 0.005) rad/s * 5 ms = 0.6 degrees at most; one that is held back by next to nothing.
const SPIKE_DEG: f64 = 0.6;

/// The largest angle between two filters, one of which reads a spike at 10 s; rad after it.
fn turned_by(
    method: Method,
    spoil: impl Fn(&mut [Vector3<f64>; 3]),
) -> (f64, Vec<Status>, AttitudeState) {
    let mut body = Body::new([0.005, 0.0, 0.0], 1.0);
    let (mut clean, mut spiked) = (filter(method), filter(method));
    let (mut worst, mut said) = (0.0_f64, Vec::new());
    for i in 0..6000 {
        let [gyro, accel, mag] = body.step(true);
        clean.step(&gyro, &accel, Some(&mag), DT_S);
        let mut sample = [gyro, accel, mag];
        if i == 2000 {
            spoil(&mut sample);
        }
        let state = spiked.step(&sample[0], &sample[1], Some(&sample[2]), DT_S);
        let apart = clean
            .state()
            .world_from_body
            .angle_to(&state.world_from_body);
        assert!(apart.is_finite(), "sample {i}");
        worst = worst.max(apart.to_degrees());
        if i == 2000 {
            said.push(state.status);
        }
    }
    (worst, said, spiked.state())
}

#[test]
fn spike_of_any_sensor_and_size_does_not_turn_the_attitude() {
    for method in [Method::Inertial, Method::Invariant] {
        for which in 0..3 {
            for size in [
                2.0, 7.0, 28.0, 60.0, 150.0, 200.0, 350.0, 1e3, 3.3e4, 1e6, 1e160, 1e300,
            ] {
                for axis in 0..3 {
                    let (worst, said, last) = turned_by(method, |s| s[which][axis] += size);
                    let what = format!("{method:?}, sensor {which}, {size:e}: {worst:.3} deg");
                    assert!(worst < SPIKE_DEG, "{what}");
                    assert_eq!(last.status, Status::Ok, "{what}");
                    if size >= 40.0 && which < 2 {
                        assert!(said[0] != Status::Ok, "{what}");
                    }
                }
            }
        }
    }
}

#[test]
fn refused_readings_are_counted() {
    let (mut body, mut filter) = (Body::new([0.0; 3], 1.0), filter(Method::Inertial));
    for i in 0..1000 {
        let [mut gyro, mut accel, mut mag] = body.step(true);
        match i {
            300 => gyro.x = 1e160,
            500 => accel.y = 1000.0,
            700 => mag.z = f64::INFINITY,
            _ => (),
        }
        filter.step(&gyro, &accel, Some(&mag), DT_S);
    }
    assert_eq!(filter.refused(), 3);
}

#[test]
fn burst_of_nonsense_tilts_the_horizon_by_degrees_only() {
    let (mut body, mut filter) = (Body::new([0.0; 3], 1.0), filter(Method::Inertial));
    for i in 0..3000 {
        let [gyro, mut accel, mag] = body.step(true);
        if (2500..2520).contains(&i) {
            accel.x = 390.0;
        }
        let state = filter.step(&gyro, &accel, Some(&mag), DT_S);
        let up = |q: &UnitQuaternion<f64>| q.inverse() * Vector3::z();
        let off = up(&state.world_from_body)
            .angle(&up(&body.rotation))
            .to_degrees();
        // A tenth of a second of 80 m/s^2 in a low-pass of 3 s: 1.7 m/s^2 of 9.81.
        assert!(i < 2500 || off < 10.5, "{off} deg at {i}");
    }
}

#[test]
fn hour_of_flaws_of_any_size_leaves_a_unit_attitude_and_a_small_bias() {
    for (method, seed) in [(Method::Inertial, 1), (Method::Invariant, 2)] {
        let (mut body, mut filter) = (Body::new([0.005, 0.0, 0.0], 1.0), filter(method));
        let mut flaws = Flaws::new(seed, 0.02);
        for i in 0..720_000 {
            let [mut gyro, mut accel, mut mag] = body.step(true);
            for v in [&mut gyro, &mut accel, &mut mag] {
                flaws.vector(v);
            }
            let mag = (!flaws.strikes()).then_some(mag);
            let state = filter.step(&gyro, &accel, mag.as_ref(), flaws.step(DT_S));
            let norm = state.world_from_body.norm();
            assert!(
                (norm - 1.0).abs() < 1e-12,
                "{method:?}, sample {i}: norm {norm}"
            );
            let bias = state.gyro_bias_rad_s.amax();
            assert!(bias < 0.4, "{method:?}, sample {i}: bias {bias}");
        }
        assert!(filter.refused() > 10_000, "{}", filter.refused());
    }
}

#[test]
fn visual_observer_through_spikes_and_flaws_stays_a_unit_attitude() {
    for size in [0.5, 3.0, 30.0, 200.0, 1e160] {
        let (mut body, mut observer) =
            (Body::new([0.0; 3], 1.0), VisualAttitude::new(2.0).unwrap());
        let mut worst = 0.0_f64;
        for i in 0..2000 {
            let [mut gyro, ..] = body.step(true);
            if i == 1000 {
                gyro.x += size;
            }
            let mut seen = body.rotation;
            if i == 1500 {
                seen *= so3::exp(&Vector3::new(0.0, 2.0, 0.0));
            }
            observer.step(&gyro, Some(&seen), DT_S);
            let off = observer.rotation().unwrap().angle_to(&body.rotation);
            worst = worst.max(off.to_degrees());
        }
        assert!(worst < SPIKE_DEG, "{size}: {worst} deg");
    }
    let (mut body, mut observer) = (Body::new([0.0; 3], 1.0), VisualAttitude::new(2.0).unwrap());
    let mut flaws = Flaws::new(3, 0.02);
    for i in 0..720_000 {
        let [mut gyro, ..] = body.step(true);
        flaws.vector(&mut gyro);
        let mut turn = Vector3::zeros();
        flaws.vector(&mut turn);
        let seen = body.rotation * so3::exp(&turn.map(|t| t.clamp(-3.0, 3.0)));
        observer.step(&gyro, Some(&seen), flaws.step(DT_S));
        let norm = observer.rotation().map_or(1.0, |q| q.norm());
        assert!((norm - 1.0).abs() < 1e-12, "sample {i}: {norm}");
    }
}
