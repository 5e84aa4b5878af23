//! What each bad sample gives, of the navigation filter and of the observer (9.5).

use super::*;
use crate::Status;
use rand::RngExt;

/// What comes at a step of 5 ms.
struct Samples {
    imu: Option<ImuSample>,
    pose: Option<Pose>,
    velocity: Option<Vector3<f64>>,
    mag: Option<Vector3<f64>>,
}

/// What is wrong, and what is said of it at step `at` and at the end of 20 s.
struct Case {
    name: &'static str,
    spoil: fn(usize, &mut Samples),
    at: usize,
    says: &'static str,
    ends: &'static str,
}

const NAN: Vector3<f64> = Vector3::new(f64::NAN, 0.0, 0.0);
const STEPS: usize = 4000;
/// A step at which everything comes.
const ALL: usize = 2100;

fn imu(s: &mut Samples, change: impl Fn(&mut ImuSample)) {
    s.imu.iter_mut().for_each(change);
}

#[rustfmt::skip]
const CASES: [Case; 15] = [
    Case { name: "NaN in the gyro", at: ALL, says: "skipped: gyro: a number is not finite", ends: "ok",
        spoil: |i, s| if i == ALL { imu(s, |s| s.gyro_rad_s = NAN) } },
    Case { name: "NaN in the accelerometer", at: ALL, says: "skipped: accelerometer: a number is not finite", ends: "ok",
        spoil: |i, s| if i == ALL { imu(s, |s| s.accel_m_s2 = NAN) } },
    Case { name: "NaN in the magnetometer", at: ALL, says: "skipped: magnetometer: a number is not finite", ends: "ok",
        spoil: |i, s| if i == ALL { s.mag = Some(NAN) } },
    Case { name: "NaN in the velocity", at: ALL, says: "skipped: velocity: a number is not finite", ends: "ok",
        spoil: |i, s| if i == ALL { s.velocity = Some(NAN) } },
    Case { name: "NaN in the pose", at: ALL, says: "skipped: pose: a number is not finite", ends: "ok",
        spoil: |i, s| if i == ALL { s.pose = s.pose.map(|p| Pose::new(p.rotation, NAN)) } },
    Case { name: "dead axis of the gyro", at: 2590, says: "gyro: axis z never changes", ends: "ok",
        spoil: |i, s| if (2000..2600).contains(&i) { imu(s, |s| s.gyro_rad_s.z = 0.01) } },
    Case { name: "dead axis of the accelerometer", at: 2590, says: "accelerometer: axis x never changes", ends: "ok",
        spoil: |i, s| if (2000..2600).contains(&i) { imu(s, |s| s.accel_m_s2.x = 0.1) } },
    Case { name: "saturated gyro", at: ALL, says: "gyro: 35.000 is at the limit", ends: "ok",
        spoil: |i, s| if i == ALL { imu(s, |s| s.gyro_rad_s.x = 35.0) } },
    Case { name: "accelerometer in g", at: 200, says: "given in g", ends: "given in g",
        spoil: |_, s| imu(s, |s| s.accel_m_s2 /= 9.81) },
    Case { name: "repeated stamp", at: ALL, says: "skipped: the stamp does not increase", ends: "ok",
        spoil: |i, s| if i == ALL { imu(s, |s| s.stamp = Tour::stamp(ALL - 1)) } },
    Case { name: "decreasing stamp", at: ALL, says: "late, more than the filter goes back", ends: "ok",
        spoil: |i, s| if i == ALL { imu(s, |s| s.stamp = Tour::stamp(ALL - 1000)) } },
    Case { name: "gap of a second", at: ALL + 200, says: "weak: 1.005 s without samples", ends: "ok",
        spoil: |i, s| if (ALL..ALL + 200).contains(&i) { *s = Samples { imu: None, pose: None, velocity: None, mag: None } } },
    Case { name: "magnet passing by", at: ALL, says: "the field is not the one", ends: "ok",
        spoil: |i, s| if (2000..2400).contains(&i) { s.mag = s.mag.map(|m| m * 1.8) } },
    Case { name: "no magnetometer", at: ALL, says: "ok", ends: "ok",
        spoil: |_, s| s.mag = None },
    Case { name: "nothing but inertial readings", at: 3000, says: "integrating", ends: "integrating",
        spoil: |i, s| if i > 2000 { (s.pose, s.velocity, s.mag) = (None, None, None) } },
];

/// What comes at a step, before it is spoilt.
fn samples(tour: &mut Tour, i: usize) -> Samples {
    let field = Vector3::new(5.0, 43.0, 20.0);
    let seen = i.is_multiple_of(7);
    Samples {
        imu: Some(tour.imu(i)),
        pose: seen.then(|| tour.pose(i)),
        velocity: seen.then(|| tour.velocity(i)),
        mag: i
            .is_multiple_of(4)
            .then(|| tour.truth(i).rotation.inverse() * field),
    }
}

/// What the filter says to each sample, one text.
fn push(filter: &mut NavigationFilter, i: usize, s: &Samples) -> String {
    let stamp = Tour::stamp(i);
    let mut said = Vec::new();
    if let Some(imu) = &s.imu {
        said.push(filter.push_imu(imu));
    }
    if let Some(pose) = &s.pose {
        said.push(filter.push_pose(stamp, pose, &pose_covariance()));
    }
    if let Some(velocity) = &s.velocity {
        said.push(filter.push_velocity(stamp, velocity, &speed_covariance()));
    }
    if let Some(mag) = &s.mag {
        said.push(filter.push_mag(stamp, mag));
    }
    let texts: Vec<String> = said.iter().map(Status::to_string).collect();
    texts.join("; ")
}

fn check(filter: &NavigationFilter, i: usize, what: &str) {
    let Some(state) = filter.state(Tour::stamp(i)) else {
        return;
    };
    let x = &state.nominal;
    let q = &x.world_from_body.rotation;
    assert!(
        (q.norm() - 1.0).abs() < 1e-12,
        "{what}, step {i}: {}",
        q.norm()
    );
    let parts = [
        x.world_from_body.translation,
        x.velocity_m_s,
        x.gyro_bias_rad_s,
        x.accel_bias_m_s2,
    ];
    assert!(
        parts.iter().flatten().all(|v| v.is_finite()),
        "{what}, step {i}"
    );
    let covariance = state.covariance.diagonal();
    assert!(
        covariance.iter().all(|v| *v >= 0.0),
        "{what}, step {i}: {covariance}"
    );
}

#[test]
fn each_bad_sample_gives_its_reason_and_a_finite_state() {
    for case in &CASES {
        let (mut tour, mut filter) = (Tour::new(5), filter());
        let mut last = String::new();
        for i in 0..STEPS {
            let mut s = samples(&mut tour, i);
            (case.spoil)(i, &mut s);
            let said = push(&mut filter, i, &s);
            check(&filter, i, case.name);
            if i == case.at {
                println!("{}, step {i}: {said}", case.name);
                assert!(said.contains(case.says), "{}: {said}", case.name);
            }
            last = filter.status().to_string();
        }
        assert!(last.contains(case.ends), "{}: {last}", case.name);
    }
}

#[test]
fn no_motion_at_all_stays_where_it_is() {
    let (mut tour, mut filter) = (Tour::new(5), filter());
    for curve in &mut tour.motion.position_m {
        curve.waves.clear();
    }
    for i in 0..12_000 {
        let mut s = samples(&mut tour, i);
        // At rest: one and the same true attitude and place.
        let rest = tour.truth(0);
        s.imu.iter_mut().for_each(|s| {
            s.gyro_rad_s = GYRO_BIAS + tour.normal(GYRO_SIGMA);
            s.accel_m_s2 = rest.rotation.inverse() * -DOWN + tour.normal(ACCEL_SIGMA);
        });
        s.velocity = s.velocity.map(|_| tour.normal(SPEED_SIGMA));
        s.pose = (i == 0).then_some(rest);
        s.mag = None;
        push(&mut filter, i, &s);
        check(&filter, i, "at rest");
    }
    let state = filter.state(Tour::stamp(11_999)).unwrap();
    assert_eq!(state.status, Status::Ok);
    let off = state.nominal.world_from_body.translation - tour.truth(0).translation;
    // A minute of velocities with 0.02 m/s of noise at 28 Hz walks 0.029 m on each axis.
    assert!(off.norm() < 0.1, "{off:?}");
    // Gravity shows the bias across it; the one about it turns the heading, which nothing shows.
    let bias = tour.truth(0).rotation * (state.nominal.gyro_bias_rad_s - GYRO_BIAS);
    assert!(bias.xz().norm() < 2e-3, "{bias:?}");
}

#[test]
fn hour_of_all_flaws_at_random_leaves_a_finite_state_of_unit_norm() {
    let (mut tour, mut filter) = (Tour::new(6), filter());
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    for i in 0..720_000 {
        let mut s = samples(&mut tour, i);
        if rng.random_bool(0.02) {
            let case = &CASES[rng.random_range(0..CASES.len())];
            (case.spoil)(case.at, &mut s);
        }
        push(&mut filter, i, &s);
        if i % 10 == 0 {
            check(&filter, i, "an hour");
        }
    }
}

/// The observer's samples: gyro, accelerometer, attitude, velocity, position, step.
struct Pulled {
    gyro: Vector3<f64>,
    accel: Vector3<f64>,
    attitude: UnitQuaternion<f64>,
    velocity: Option<Vector3<f64>>,
    position: Option<Vector3<f64>>,
    dt_s: f64,
}

/// Name, what is wrong, step and what is said there.
type PulledCase = (&'static str, fn(usize, &mut Pulled), usize, &'static str);

#[rustfmt::skip]
const PULLED: [PulledCase; 12] = [
    ("NaN in the gyro", |i, s| if i == 2000 { s.gyro = NAN }, 2000, "skipped: gyro: a number is not finite"),
    ("NaN in the accelerometer", |i, s| if i == 2000 { s.accel = NAN }, 2000, "skipped: accelerometer: a number is not finite"),
    ("NaN in the velocity", |i, s| if i == 2000 { s.velocity = Some(NAN) }, 2000, "weak: velocity: a number is not finite"),
    ("NaN in the position", |i, s| if i == 2000 { s.position = Some(NAN) }, 2000, "weak: pose: a number is not finite"),
    ("NaN in the attitude", |i, s| if i == 2000 { s.attitude.as_mut_unchecked().coords.x = f64::NAN }, 2000, "skipped: pose: a number is not finite"),
    ("dead axis of the gyro", |i, s| if (2000..2600).contains(&i) { s.gyro.z = 0.01 }, 2500, "gyro: axis z never changes"),
    ("saturated gyro", |i, s| if i == 2000 { s.gyro.x = 35.0 }, 2000, "gyro: 35.000 is at the limit"),
    ("accelerometer in g", |i, s| if (1000..3000).contains(&i) { s.accel /= 9.81 }, 2900, "accelerometer: mean norm"),
    ("repeated stamp", |i, s| if i == 2000 { s.dt_s = 0.0 }, 2000, "skipped: the stamp does not increase"),
    ("decreasing stamp", |i, s| if i == 2000 { s.dt_s = -0.02 }, 2000, "skipped: the stamp does not increase"),
    ("gap of a second", |i, s| if i == 2000 { s.dt_s = 1.0 }, 2000, "weak: 1.000 s without samples"),
    ("no measurement", |i, s| if (2000..2600).contains(&i) { (s.velocity, s.position) = (None, None) }, 2500, "integrating"),
];

#[test]
fn position_observer_names_each_bad_sample_and_is_back_after_it() {
    for (name, spoil, at, says) in PULLED {
        let mut tour = Tour::new(1);
        tour.motion = Motion::hand_held(3);
        let zero = Vector3::zeros();
        let gains = PositionGains::default();
        let mut observer = PositionObserver::new(gains, DOWN, zero, zero).unwrap();
        let mut status = Status::Ok;
        for i in 1..STEPS {
            let truth = tour.motion.state(i as f64 * DT_S);
            let sample = tour.imu(i);
            let mut s = Pulled {
                gyro: sample.gyro_rad_s - GYRO_BIAS,
                accel: sample.accel_m_s2 - ACCEL_BIAS,
                attitude: truth.world_from_camera.rotation,
                velocity: Some(truth.twist.linear_m_s + tour.normal(0.01)),
                position: Some(truth.world_from_camera.translation + tour.normal(0.005)),
                dt_s: DT_S,
            };
            spoil(i, &mut s);
            let (v, x) = (s.velocity.as_ref(), s.position.as_ref());
            status = observer.step(&s.gyro, &s.accel, &s.attitude, v, x, s.dt_s);
            let told = [observer.velocity(), observer.position()];
            assert!(told.iter().flatten().all(|v| v.is_finite()), "{name}, {i}");
            if i == at {
                println!("{name}, step {i}: {status}");
                assert!(status.to_string().contains(says), "{name}: {status}");
            }
        }
        assert_eq!(status, Status::Ok, "{name}");
        let truth = tour
            .motion
            .state((STEPS - 1) as f64 * DT_S)
            .world_from_camera;
        let off = (observer.position() - truth.translation).norm();
        assert!(off < 0.01, "{name}: {off} m");
    }
}
