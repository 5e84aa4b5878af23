//! What each bad sample gives, for both estimators: status and reason, a finite state, unit norm.

use super::*;
use rand::RngExt;

/// A sample as it may come.
struct Sample {
    gyro: Vector3<f64>,
    accel: Vector3<f64>,
    mag: Option<Vector3<f64>>,
    dt_s: f64,
}

/// What is wrong, at which samples, and what is said of it at `at` and at the end of 20 s.
struct Case {
    name: &'static str,
    spoil: fn(usize, &mut Sample),
    at: usize,
    says: &'static str,
    ends: &'static str,
}

const COUNT: usize = 4000;
const NAN: f64 = f64::NAN;

#[rustfmt::skip]
const CASES: [Case; 13] = [
    Case { name: "NaN in the gyro", at: 2000, says: "skipped: gyro: a number is not finite", ends: "ok",
        spoil: |i, s| if i == 2000 { s.gyro.y = NAN } },
    Case { name: "NaN in the accelerometer", at: 2000, says: "weak: accelerometer: a number is not finite", ends: "ok",
        spoil: |i, s| if i == 2000 { s.accel.x = NAN } },
    Case { name: "NaN in the magnetometer", at: 2000, says: "weak: magnetometer: a number is not finite", ends: "ok",
        spoil: |i, s| if i == 2000 { s.mag = Some(Vector3::repeat(NAN)) } },
    Case { name: "dead axis of the gyro", at: 2500, says: "gyro: axis z never changes", ends: "ok",
        spoil: |i, s| if (2000..2600).contains(&i) { s.gyro.z = 0.1 } },
    Case { name: "dead axis of the accelerometer", at: 3999, says: "accelerometer: axis x never changes", ends: "axis x",
        spoil: |i, s| if i > 2000 { s.accel.x = 0.0 } },
    Case { name: "saturated gyro", at: 2000, says: "gyro: 35.000 is at the limit", ends: "ok",
        spoil: |i, s| if i == 2000 { s.gyro.x = 35.0 } },
    Case { name: "accelerometer in g", at: 400, says: "given in g", ends: "given in g",
        spoil: |_, s| s.accel /= 9.81 },
    Case { name: "repeated stamp", at: 2000, says: "skipped: the stamp does not increase", ends: "ok",
        spoil: |i, s| if i == 2000 { s.dt_s = 0.0 } },
    Case { name: "decreasing stamp", at: 2000, says: "skipped: the stamp does not increase", ends: "ok",
        spoil: |i, s| if i == 2000 { s.dt_s = -0.02 } },
    Case { name: "gap of a second", at: 2000, says: "weak: 1.000 s without samples", ends: "ok",
        spoil: |i, s| if i == 2000 { s.dt_s = 1.0 } },
    Case { name: "magnet passing by", at: 2600, says: "the field is not the one", ends: "ok",
        spoil: |i, s| if (2000..2800).contains(&i) { s.mag = s.mag.map(|m| m * 1.8) } },
    Case { name: "no magnetometer", at: 3000, says: "no magnetometer", ends: "no magnetometer",
        spoil: |_, s| s.mag = None },
    Case { name: "zeros from all sensors", at: 3000, says: "mean norm 0.000", ends: "mean norm 0.000",
        spoil: |_, s| (s.gyro, s.accel, s.mag) = (Vector3::zeros(), Vector3::zeros(), Some(Vector3::zeros())) },
];

fn check(state: &AttitudeState, what: &str) {
    let q = &state.world_from_body;
    assert!((q.norm() - 1.0).abs() < 1e-12, "{what}: norm {}", q.norm());
    assert!(
        state.gyro_bias_rad_s.iter().all(|v| v.is_finite()),
        "{what}"
    );
}

#[test]
fn each_bad_sample_gives_its_reason_and_a_finite_state() {
    for method in [Method::Inertial, Method::Invariant] {
        for case in &CASES {
            let (mut body, mut filter) = (Body::new([0.005, 0.0, 0.0], 1.0), filter(method));
            for i in 0..COUNT {
                let [gyro, accel, mag] = body.step(true);
                let mag = Some(mag);
                let mut s = Sample {
                    gyro,
                    accel,
                    mag,
                    dt_s: DT_S,
                };
                (case.spoil)(i, &mut s);
                let state = filter.step(&s.gyro, &s.accel, s.mag.as_ref(), s.dt_s);
                check(&state, case.name);
                let said = state.status.to_string();
                let what = format!("{method:?}, {}, sample {i}: {said}", case.name);
                if i == case.at {
                    println!("{what}");
                    assert!(said.contains(case.says), "{what}");
                }
                assert!(i + 1 < COUNT || said.contains(case.ends), "{what}");
            }
        }
    }
}

#[test]
fn no_motion_at_all_is_rest_and_the_bias_is_found() {
    for method in [Method::Inertial, Method::Invariant] {
        let (mut body, mut filter) = (Body::new([0.005, -0.003, 0.002], 1.0), filter(method));
        for _ in 0..40_000 {
            let [gyro, accel, mag] = body.step(false);
            check(&filter.step(&gyro, &accel, Some(&mag), DT_S), "at rest");
        }
        let state = filter.state();
        assert_eq!(
            (state.status, state.at_rest),
            (Status::Ok, true),
            "{method:?}"
        );
        let off = (state.gyro_bias_rad_s - body.bias).norm();
        assert!(off < 1e-3, "{method:?}: {off}");
    }
}

#[test]
fn hour_of_all_flaws_at_random_leaves_a_finite_state_of_unit_norm() {
    for method in [Method::Inertial, Method::Invariant] {
        let (mut body, mut filter) = (Body::new([0.005, 0.0, 0.0], 1.0), filter(method));
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        for i in 0..720_000 {
            let [gyro, accel, mag] = body.step(true);
            let mut s = Sample {
                gyro,
                accel,
                mag: Some(mag),
                dt_s: DT_S,
            };
            if rng.random_bool(0.02) {
                // The cases' own samples are those at which they say something.
                let case = &CASES[rng.random_range(0..CASES.len())];
                (case.spoil)(case.at, &mut s);
            }
            let state = filter.step(&s.gyro, &s.accel, s.mag.as_ref(), s.dt_s);
            check(&state, &format!("{method:?}, sample {i}"));
        }
    }
}
