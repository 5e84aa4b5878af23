//! What each bad sample gives, for all three estimators: status and reason, and finite biases.

use super::*;
use rand::RngExt;

/// Images and velocities as they may come.
struct Sample {
    grey: Plane<f32>,
    range: RangeMap,
    velocity: ImageVelocity,
    dt_s: f64,
}

/// What is wrong, and what is said of it at frame `at` and at the end of 4 s.
struct Case {
    name: &'static str,
    spoil: fn(usize, &mut Sample),
    at: usize,
    says: &'static str,
    ends: &'static str,
}

const FRAMES: usize = 168;
const NAN: Vector3<f64> = Vector3::new(f64::NAN, 0.0, 0.0);

fn blind() -> RangeMap {
    RangeMap::new(Plane::filled(160, 120, f32::NAN))
}

#[rustfmt::skip]
const CASES: [Case; 10] = [
    Case { name: "NaN in the angular velocity", at: 60, says: "skipped: velocity: a number is not finite", ends: "ok",
        spoil: |i, s| if i == 60 { s.velocity.angular_rad_s = NAN } },
    Case { name: "NaN in the linear velocity", at: 60, says: "skipped: velocity: a number is not finite", ends: "ok",
        spoil: |i, s| if i == 60 { s.velocity.linear_m_s = Some(NAN) } },
    Case { name: "no range", at: 60, says: "skipped: only 0.0 % of the pixels", ends: "ok",
        spoil: |i, s| if (60..64).contains(&i) { s.range = blind() } },
    Case { name: "no brightness", at: 60, says: "ok", ends: "ok",
        spoil: |i, s| if i == 60 { s.grey = Plane::filled(160, 120, f32::NAN) } },
    Case { name: "dead axis of the gyro", at: 155, says: "velocity: axis z never changes", ends: "ok",
        spoil: |i, s| if (60..160).contains(&i) { s.velocity.angular_rad_s.z = 0.3 } },
    Case { name: "saturated gyro", at: 60, says: "gyro: 36.000 is at the limit", ends: "ok",
        spoil: |i, s| if i == 60 { s.velocity.angular_rad_s.x = 36.0 } },
    Case { name: "repeated stamp", at: 60, says: "skipped: the stamp does not increase", ends: "ok",
        spoil: |i, s| if i == 60 { s.dt_s = 0.0 } else if i == 61 { s.dt_s *= 2.0 } },
    Case { name: "decreasing stamp", at: 60, says: "skipped: the stamp does not increase", ends: "ok",
        spoil: |i, s| if i == 60 { s.dt_s = -0.01 } else if i == 61 { s.dt_s *= 2.0 } },
    Case { name: "gap of a second", at: 60, says: "weak: 1.000 s without samples", ends: "ok",
        spoil: |i, s| if i == 60 { s.dt_s = 1.0 } },
    Case { name: "no linear velocity", at: 60, says: "ok", ends: "ok",
        spoil: |_, s| s.velocity.linear_m_s = None },
];

const METHODS: [BiasMethod; 3] = [
    BiasMethod::Information,
    BiasMethod::Observer,
    BiasMethod::Normalised,
];

fn estimator(camera: &Camera, method: BiasMethod) -> VelocityBiasEstimator {
    let config = VelocityBiasConfig {
        method,
        ..VelocityBiasConfig::default()
    };
    VelocityBiasEstimator::new(camera, config).unwrap()
}

fn sample(simulation: &mut Simulation) -> Sample {
    let (grey, range, velocity, dt_s) = simulation.next();
    Sample {
        grey,
        range,
        velocity,
        dt_s,
    }
}

fn step(estimator: &mut VelocityBiasEstimator, s: &Sample, what: &str) -> VelocityBiasState {
    let state = estimator
        .step(&s.grey, &s.range, &s.velocity, s.dt_s)
        .unwrap();
    let linear = state.linear_m_s.unwrap_or_default();
    let covariance = state.covariance.unwrap_or_default();
    let numbers = state.angular_rad_s.iter().chain(&linear).chain(&covariance);
    assert!(numbers.copied().all(f64::is_finite), "{what}");
    state
}

#[test]
fn each_bad_sample_gives_its_reason_and_finite_biases() {
    let camera = camera(160, 120);
    for method in METHODS {
        for case in &CASES {
            let mut simulation = Simulation::new(&camera, EXACT);
            let mut estimator = estimator(&camera, method);
            for i in 0..FRAMES {
                let mut s = sample(&mut simulation);
                (case.spoil)(i, &mut s);
                let what = format!("{method:?}, {}, frame {i}", case.name);
                let said = step(&mut estimator, &s, &what).status.to_string();
                if i == case.at {
                    println!("{what}: {said}");
                    assert!(said.contains(case.says), "{what}: {said}");
                }
                assert!(i + 1 < FRAMES || said.contains(case.ends), "{what}: {said}");
            }
            if method == BiasMethod::Information && !case.name.contains("dead") {
                let off = (estimator.state().angular_rad_s - ANGULAR_BIAS).norm();
                assert!(off < 1e-3, "{}: {off} rad/s", case.name);
            }
        }
    }
}

#[test]
fn no_motion_at_all_shows_the_biases_all_the_same() {
    let camera = camera(160, 120);
    let mut simulation = Simulation::new(&camera, EXACT);
    for curve in &mut simulation.motion.position_m {
        curve.waves.clear();
    }
    for curve in [
        &mut simulation.motion.yaw_rad,
        &mut simulation.motion.pitch_rad,
        &mut simulation.motion.roll_rad,
    ] {
        curve.waves.clear();
    }
    let mut estimator = estimator(&camera, BiasMethod::Information);
    for i in 0..84 {
        step(&mut estimator, &sample(&mut simulation), &format!("{i}"));
    }
    let state = estimator.state();
    assert_eq!(state.status, Status::Ok);
    assert!((state.angular_rad_s - ANGULAR_BIAS).norm() < 2e-4);
    assert!((state.linear_m_s.unwrap() - LINEAR_BIAS).norm() < 3e-3);
}

#[test]
fn many_flaws_at_random_leave_finite_biases() {
    // An hour of frames at 0.5 Hz: a small image makes them affordable.
    let camera = camera(40, 30);
    let mut simulation = Simulation::new(&camera, THESIS);
    let mut clean: Vec<Sample> = (0..210).map(|_| sample(&mut simulation)).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    for method in METHODS {
        let mut estimator = estimator(&camera, method);
        for i in 0..1800 {
            let s = &mut clean[i % 210];
            let dt_s = s.dt_s;
            if rng.random_bool(0.05) {
                s.dt_s = [0.0, -1.0, 1.0, f64::NAN][rng.random_range(0..4)];
            }
            let velocity = s.velocity;
            if rng.random_bool(0.05) {
                let bad = [NAN, Vector3::repeat(40.0), Vector3::zeros()];
                s.velocity.angular_rad_s = bad[rng.random_range(0..3)];
            }
            step(&mut estimator, s, &format!("{method:?}, frame {i}"));
            (s.dt_s, s.velocity) = (dt_s, velocity);
        }
    }
}
