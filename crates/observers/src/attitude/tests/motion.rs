//! What the filters reach on simulated motion, and that their answers are unit quaternions.

use super::*;

/// Noise of the field (1 %) leaves 0.1 deg of heading; lag and bias as much again.
const SETTLED_DEG: f64 = 0.5;

#[test]
fn inertial_filter_finds_attitude_and_bias_in_motion_and_at_rest() {
    let bias = [0.008, -0.005, 0.004];
    for moves in [true, false] {
        let (mut body, mut filter) = (Body::new(bias, 1.0), filter(Method::Inertial));
        let mut state = filter.state();
        for _ in 0..40_000 {
            let [gyro, accel, mag] = body.step(moves);
            state = filter.step(&gyro, &accel, Some(&mag), DT_S);
        }
        let off = state.world_from_body.angle_to(&body.rotation).to_degrees();
        assert!(off < SETTLED_DEG, "{off} deg, moves {moves}");
        let bias_off = (state.gyro_bias_rad_s - body.bias).norm();
        assert!(bias_off < 2e-3, "{bias_off} rad/s, moves {moves}");
        assert_eq!((state.status, state.at_rest), (Status::Ok, !moves));
    }
}

#[test]
fn attitude_norm_after_an_hour_is_one() {
    for method in [Method::Inertial, Method::Invariant] {
        let (mut body, mut filter) = (Body::new([0.01, 0.0, -0.01], 1.0), filter(method));
        let mut worst = 0.0_f64;
        for i in 0..720_000 {
            let [gyro, accel, mag] = body.step(true);
            filter.step(&gyro, &accel, Some(&mag), DT_S);
            if i % 1000 == 999 {
                worst = worst.max((filter.state().world_from_body.norm() - 1.0).abs());
            }
        }
        assert!(worst < 1e-12, "{method:?}: {worst:e}");
    }
}

#[test]
fn world_of_a_camera_is_the_earth_frame_turned() {
    let mut body = Body::new([0.0; 3], 0.0);
    let mut enu = filter(Method::Inertial);
    let mut rdf = AttitudeFilter::new(AttitudeConfig {
        world: World::RightDownForward,
        ..AttitudeConfig::default()
    })
    .unwrap();
    for _ in 0..400 {
        let [gyro, accel, mag] = body.step(true);
        enu.step(&gyro, &accel, Some(&mag), DT_S);
        rdf.step(&gyro, &accel, Some(&mag), DT_S);
    }
    let (a, b) = (enu.state().world_from_body, rdf.state().world_from_body);
    for v in [Vector3::x(), Vector3::y(), Vector3::z()] {
        let (enu, rdf) = (a * v, b * v);
        let expected = Vector3::new(enu.x, -enu.z, enu.y);
        assert!((rdf - expected).norm() < 1e-12, "{rdf:?} {expected:?}");
    }
}

#[test]
fn step_with_changing_time_step_equals_an_even_one() {
    let (mut body, mut even, mut uneven) = (
        Body::new([0.005, 0.0, 0.0], 0.0),
        filter(Method::Inertial),
        filter(Method::Inertial),
    );
    let (mut pending, mut turned) = (0.0, Vector3::zeros());
    for i in 0..20_000 {
        let [gyro, accel, mag] = body.step(true);
        even.step(&gyro, &accel, Some(&mag), DT_S);
        (pending, turned) = (pending + DT_S, turned + gyro * DT_S);
        // now one, now two steps at once
        if i % 3 != 1 {
            uneven.step(&(turned / pending), &accel, Some(&mag), pending);
            (pending, turned) = (0.0, Vector3::zeros());
        }
    }
    for filter in [&even, &uneven] {
        let off = filter
            .state()
            .world_from_body
            .angle_to(&body.rotation)
            .to_degrees();
        assert!(off < SETTLED_DEG, "{off}");
    }
    let apart = even
        .state()
        .world_from_body
        .angle_to(&uneven.state().world_from_body);
    // The biases settle at different speeds, and 1e-3 rad/s make half a degree of heading.
    assert!(apart.to_degrees() < 0.3, "{apart} rad");
}

#[test]
fn run_equals_sample_by_sample() {
    let mut body = Body::new([0.01, -0.01, 0.0], 1.0);
    let samples: Vec<[Vector3<f64>; 3]> = (0..500).map(|_| body.step(true)).collect();
    let column = |i: usize| samples.iter().map(|s| s[i]).collect::<Vec<_>>();
    let stamps: Vec<Stamp> = (0..500).map(|i| Stamp::from_ns(i * 5_000_000)).collect();
    let run = filter(Method::Inertial)
        .run(&column(0), &column(1), Some(&column(2)), &stamps)
        .unwrap();
    let mut single = filter(Method::Inertial);
    for [gyro, accel, mag] in &samples {
        single.step(gyro, accel, Some(mag), DT_S);
    }
    assert_eq!(run.world_from_body[499], single.state().world_from_body);
    let short = filter(Method::Inertial).run(&column(0), &column(1)[1..], None, &stamps);
    assert!(short.unwrap_err().to_string().contains("accel"));
}
