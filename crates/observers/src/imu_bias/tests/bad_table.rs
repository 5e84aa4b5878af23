//! What each bad sample gives, for filter and observer: status and reason, and a finite state.

use super::*;
use rand::RngExt;

/// What is wrong, and what is said of it at sample `at` and at the end of 20 s.
struct Case {
    name: &'static str,
    spoil: fn(usize, &mut ImuBiasSample),
    at: usize,
    says: &'static str,
    ends: &'static str,
}

const NAN: Vector3<f64> = Vector3::new(f64::NAN, 0.0, 0.0);

#[rustfmt::skip]
const CASES: [Case; 15] = [
    Case { name: "NaN in the gyro", at: 2000, says: "skipped: gyro: a number is not finite", ends: "ok",
        spoil: |i, s| if i == 2000 { s.gyro_rad_s = NAN } },
    Case { name: "NaN in the accelerometer", at: 2000, says: "skipped: accelerometer: a number is not finite", ends: "ok",
        spoil: |i, s| if i == 2000 { s.accel_m_s2 = NAN } },
    Case { name: "NaN in the magnetometer", at: 2000, says: "weak: magnetometer: a number is not finite", ends: "ok",
        spoil: |i, s| if i == 2000 { s.mag = Some(NAN) } },
    Case { name: "NaN in the velocity", at: 2000, says: "weak: velocity: a number is not finite", ends: "ok",
        spoil: |i, s| if i == 2000 { s.velocity = Some(VelocityMeasurement::isotropic(NAN, 0.01, None, 0.01)) } },
    Case { name: "dead axis of the gyro", at: 2500, says: "gyro: axis z never changes", ends: "ok",
        spoil: |i, s| if (2000..2600).contains(&i) { s.gyro_rad_s.z = 0.1 } },
    Case { name: "dead axis of the accelerometer", at: 2500, says: "accelerometer: axis x never changes", ends: "ok",
        spoil: |i, s| if (2000..2600).contains(&i) { s.accel_m_s2.x = 0.1 } },
    Case { name: "saturated gyro", at: 2000, says: "gyro: 35.000 is at the limit", ends: "ok",
        spoil: |i, s| if i == 2000 { s.gyro_rad_s.x = 35.0 } },
    Case { name: "accelerometer in g", at: 200, says: "given in g", ends: "given in g",
        spoil: |_, s| s.accel_m_s2 /= 9.81 },
    Case { name: "repeated stamp", at: 2000, says: "skipped: the stamp does not increase", ends: "ok",
        spoil: |i, s| if i == 2000 { s.dt_s = 0.0 } },
    Case { name: "decreasing stamp", at: 2000, says: "skipped: the stamp does not increase", ends: "ok",
        spoil: |i, s| if i == 2000 { s.dt_s = -0.02 } },
    Case { name: "gap of a second", at: 2000, says: "weak: 1.000 s without samples", ends: "ok",
        spoil: |i, s| if i == 2000 { s.dt_s = 1.0 } },
    Case { name: "magnet passing by", at: 2200, says: "the field is not the one", ends: "ok",
        spoil: |i, s| if (2000..2400).contains(&i) { s.mag = s.mag.map(|m| m * 1.8) } },
    Case { name: "magnet that turns the field", at: 2200, says: "the field is not the one", ends: "ok",
        spoil: |i, s| if (2000..2400).contains(&i) { s.mag = s.mag.map(|m| -m) } },
    Case { name: "no magnetometer", at: 3900, says: "ok", ends: "ok",
        spoil: |_, s| s.mag = None },
    Case { name: "velocity lost", at: 3900, says: "without position or velocity: integrating", ends: "integrating",
        spoil: |i, s| if i > 2000 { s.velocity = None } },
];

fn check(state: &ImuBiasState, what: &str) {
    let parts = [
        state.velocity_m_s,
        state.gravity_m_s2,
        state.gyro_bias_rad_s,
        state.accel_bias_m_s2,
    ];
    assert!(parts.iter().flatten().all(|v| v.is_finite()), "{what}");
    let covariance = state.covariance.unwrap_or_default();
    assert!(covariance.iter().all(|v| v.is_finite()), "{what}");
    assert!(covariance.diagonal().min() >= 0.0, "{what}");
}

#[test]
fn each_bad_sample_gives_its_reason_and_a_finite_state() {
    let motion = looking_around();
    for method in [ImuBiasMethod::Ekf, ImuBiasMethod::Observer] {
        for case in &CASES {
            let mut samples = samples(&motion, 20.0, 30.0, BEST_FLOW, 1);
            for (i, sample) in samples.iter_mut().enumerate() {
                (case.spoil)(i, sample);
            }
            let run = ImuBiasEstimator::new(config(method)).unwrap().run(&samples);
            for (i, state) in run.states.iter().enumerate() {
                check(state, &format!("{method:?}, {}, sample {i}", case.name));
            }
            let (at, last) = (run.states[case.at].status, run.states[3999].status);
            println!(
                "{method:?}, {}, sample {}: {at}; at the end {last}",
                case.name, case.at
            );
            // 20 s are too few for the observer, and it says so.
            let observer = method == ImuBiasMethod::Observer;
            let expected = |text: &'static str| match text {
                "ok" if observer => "settling",
                other => other,
            };
            let says = expected(case.says);
            assert!(at.to_string().contains(says), "{}: {at}", case.name);
            assert!(
                last.to_string().contains(expected(case.ends)),
                "{}: {last}",
                case.name
            );
        }
    }
}

#[test]
fn flaws_that_pass_leave_the_biases_as_they_are_found_without() {
    let motion = looking_around();
    let clean = samples(&motion, 40.0, 30.0, BEST_FLOW, 1);
    let off = |samples: &[ImuBiasSample]| {
        let run = ImuBiasEstimator::new(config(ImuBiasMethod::Ekf))
            .unwrap()
            .run(samples);
        let last = run.states.last().unwrap();
        [
            (last.gyro_bias_rad_s - GYRO_BIAS).norm(),
            (last.accel_bias_m_s2 - ACCEL_BIAS).norm(),
        ]
    };
    let without = off(&clean);
    // An accelerometer's or a gyro's dead axis lies to the end; so does a wrong unit.
    for case in CASES
        .iter()
        .filter(|c| c.ends == "ok" && !c.name.contains("dead"))
    {
        let mut spoilt = clean.clone();
        for (i, sample) in spoilt.iter_mut().enumerate() {
            // The clock of a step that is not told stands still.
            (case.spoil)(i, sample);
        }
        let with = off(&spoilt);
        println!("{}: {with:.5?} with, {without:.5?} without", case.name);
        assert!(with[0] < 5e-4 && with[1] < 0.02, "{}: {with:?}", case.name);
    }
}

#[test]
fn no_motion_at_all_finds_the_gyro_and_names_what_it_cannot_tell() {
    let mut motion = looking_around();
    for curve in [
        &mut motion.yaw_rad,
        &mut motion.pitch_rad,
        &mut motion.roll_rad,
    ] {
        curve.waves.clear();
    }
    for curve in &mut motion.position_m {
        curve.waves.clear();
    }
    for method in [ImuBiasMethod::Ekf, ImuBiasMethod::Observer] {
        let samples = samples(&motion, 120.0, 30.0, BEST_FLOW, 2);
        let run = ImuBiasEstimator::new(config(method)).unwrap().run(&samples);
        let last = run.states.last().unwrap();
        let said = last.status.to_string();
        assert!(said.contains("not observable"), "{method:?}: {said}");
        let off = (last.gyro_bias_rad_s - GYRO_BIAS).norm();
        assert!(off < 2e-3, "{method:?}: {off}");
    }
}

#[test]
fn hour_of_all_flaws_at_random_leaves_a_finite_state() {
    let motion = looking_around();
    // The clean minute is used over and over: what counts is the number of flaws.
    let clean = samples(&motion, 60.0, 30.0, BEST_FLOW, 3);
    for method in [ImuBiasMethod::Ekf, ImuBiasMethod::Observer] {
        let mut estimator = ImuBiasEstimator::new(config(method)).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        for i in 0..720_000 {
            let mut sample = clean[i % clean.len()];
            if rng.random_bool(0.02) {
                let case = &CASES[rng.random_range(0..CASES.len())];
                (case.spoil)(case.at, &mut sample);
            }
            let state = estimator.step(
                &sample.gyro_rad_s,
                &sample.accel_m_s2,
                sample.velocity.as_ref(),
                sample.mag.as_ref(),
                sample.dt_s,
            );
            check(&state, &format!("{method:?}, sample {i}"));
        }
    }
}
