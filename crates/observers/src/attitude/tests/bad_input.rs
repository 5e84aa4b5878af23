//! Bad samples: a status with a reason, and a state that stays finite.

use super::*;

/// Run with samples spoilt by `spoil(i, sample)`; returns the statuses and the last state.
fn run(
    count: usize,
    moves: bool,
    spoil: impl Fn(usize, &mut [Vector3<f64>; 3]),
) -> (Vec<Status>, AttitudeState) {
    let (mut body, mut filter) = (Body::new([0.005, 0.0, 0.0], 1.0), filter(Method::Inertial));
    let mut statuses = Vec::new();
    for i in 0..count {
        let mut sample = body.step(moves);
        spoil(i, &mut sample);
        let state = filter.step(&sample[0], &sample[1], Some(&sample[2]), DT_S);
        assert!(
            state.world_from_body.coords.iter().all(|v| v.is_finite()),
            "sample {i}"
        );
        assert!(
            state.gyro_bias_rad_s.iter().all(|v| v.is_finite()),
            "sample {i}"
        );
        assert!(
            (state.world_from_body.norm() - 1.0).abs() < 1e-12,
            "sample {i}"
        );
        statuses.push(state.status);
    }
    (statuses, filter.state())
}

#[test]
fn nan_of_each_sensor_is_named_and_the_state_stays() {
    for (which, sensor) in [(0, Sensor::Gyro), (1, Sensor::Accel), (2, Sensor::Mag)] {
        let (statuses, _) = run(3000, true, |i, s| {
            if i % 50 == 7 {
                s[which].y = f64::NAN;
            }
        });
        assert_eq!(statuses[2957].reason(), Some(Reason::NotFinite { sensor }));
        assert_eq!(statuses[2999].reason(), None, "{}", statuses[2999]);
    }
}

#[test]
fn dead_axis_is_named() {
    let (statuses, _) = run(1000, true, |_, s| s[0].z = 0.25);
    let expected = Reason::DeadAxis {
        sensor: Sensor::Gyro,
        axis: 2,
    };
    assert_eq!(statuses[999], Status::Weak(expected));
    let (statuses, _) = run(1000, true, |_, s| s[1].x = 0.0);
    assert!(statuses[999].to_string().contains("accelerometer: axis x"));
}

#[test]
fn saturated_gyro_is_told_and_lasts_until_the_heading_is_back() {
    let (statuses, _) = run(4000, true, |i, s| {
        if i == 1500 {
            s[0].x = 40.0;
        }
    });
    for i in [1500, 2500] {
        assert!(
            matches!(statuses[i], Status::Weak(Reason::Saturated { .. })),
            "{}",
            statuses[i]
        );
    }
    assert_eq!(statuses[3999], Status::Ok);
}

#[test]
fn accelerometer_in_g_is_named_and_the_attitude_is_still_right() {
    let (mut body, mut filter) = (Body::new([0.0; 3], 0.0), filter(Method::Inertial));
    let mut state = filter.state();
    for _ in 0..4000 {
        let [gyro, accel, mag] = body.step(true);
        state = filter.step(&gyro, &(accel / 9.81), Some(&mag), DT_S);
    }
    assert!(
        state.status.to_string().contains("given in g"),
        "{}",
        state.status
    );
    assert!(state.world_from_body.angle_to(&body.rotation) < 0.01);
}

#[test]
fn stamps_that_repeat_or_fall_are_skipped() {
    let (mut body, mut filter) = (Body::new([0.0; 3], 0.0), filter(Method::Inertial));
    let [gyro, accel, mag] = body.step(true);
    filter.step(&gyro, &accel, Some(&mag), DT_S);
    let before = filter.state().world_from_body;
    for dt_s in [0.0, -0.01, f64::NAN] {
        let state = filter.step(&gyro, &accel, Some(&mag), dt_s);
        assert_eq!(state.status, Status::Skipped(Reason::StampNotIncreasing));
        assert_eq!(state.world_from_body, before);
    }
    let stamps = [0, 5, 5, 3, 10].map(|ms| Stamp::from_ns(ms * 1_000_000));
    let run = filter.run(&[gyro; 5], &[accel; 5], None, &stamps).unwrap();
    let skipped: Vec<bool> = run.status.iter().map(|s| !s.is_used()).collect();
    assert_eq!(skipped, [false, false, true, true, false]);
}

#[test]
fn gap_of_a_second_is_told_and_the_attitude_found_again() {
    let (mut body, mut filter) = (Body::new([0.0; 3], 1.0), filter(Method::Inertial));
    let mut state = filter.state();
    for i in 0..6000 {
        let [gyro, accel, mag] = body.step(true);
        if (3000..3199).contains(&i) {
            continue;
        }
        let dt_s = if i == 3199 { 200.0 * DT_S } else { DT_S };
        state = filter.step(&gyro, &accel, Some(&mag), dt_s);
        if i == 3199 {
            assert!(
                matches!(state.status, Status::Weak(Reason::Gap { .. })),
                "{}",
                state.status
            );
        }
    }
    assert_eq!(state.status, Status::Ok);
    assert!(state.world_from_body.angle_to(&body.rotation).to_degrees() < 1.0);
}

#[test]
fn magnet_passing_by_is_left_out() {
    let (mut body, mut filter) = (Body::new([0.0; 3], 1.0), filter(Method::Inertial));
    let mut worst = 0.0_f64;
    for i in 0..10_000 {
        let [gyro, accel, mut mag] = body.step(true);
        let passing = (6000..7000).contains(&i);
        if passing {
            mag += body.rotation.inverse() * Vector3::new(60.0, 0.0, 30.0);
        }
        let state = filter.step(&gyro, &accel, Some(&mag), DT_S);
        if passing && i > 6100 {
            assert_eq!(state.status, Status::Weak(Reason::MagneticDisturbance));
        }
        if i > 4000 {
            worst = worst.max(state.world_from_body.angle_to(&body.rotation).to_degrees());
        }
    }
    // Believed, this magnet would turn the heading by 30 deg.
    assert!(worst < 1.0, "{worst} deg");
    assert_eq!(filter.state().status, Status::Ok);
}

#[test]
fn without_magnetometer_the_heading_is_called_relative() {
    let (mut body, mut filter) = (Body::new([0.0; 3], 1.0), filter(Method::Inertial));
    let mut state = filter.state();
    for _ in 0..3000 {
        let [gyro, accel, _] = body.step(true);
        state = filter.step(&gyro, &accel, None, DT_S);
    }
    assert_eq!(state.status, Status::Weak(Reason::NoMagnetometer));
    let up = state.world_from_body.inverse() * Vector3::z();
    assert!(
        up.angle(&(body.rotation.inverse() * Vector3::z()))
            .to_degrees()
            < 0.3
    );
}

#[test]
fn free_fall_and_zero_field_leave_the_state_finite() {
    run(500, true, |_, s| s[1] = Vector3::zeros());
    run(500, true, |_, s| s[2] = Vector3::zeros());
    run(500, false, |_, s| *s = [Vector3::zeros(); 3]);
}

#[test]
fn setting_out_of_range_is_an_error_that_names_it() {
    let config = AttitudeConfig {
        tau_mag_s: -1.0,
        ..AttitudeConfig::default()
    };
    let error = AttitudeFilter::new(config).unwrap_err().to_string();
    assert!(error.contains("tau_mag_s"), "{error}");
}
