//! Single readings of any size, gaps of a day, and an hour of flaws of any size.

use super::*;
use crate::flaws::Flaws;
use crate::kalman::is_sound;

/// A spike of one sample of 5 ms that is not held back: 2 rad/s, 25 m/s^2 (see the gate for spikes).
const SPIKE_DEG: f64 = 0.6;
const SPIKE_M_S: f64 = 0.13;

fn sound(filter: &NavigationFilter, stamp: Stamp, what: &str) {
    let Some(state) = filter.state(stamp) else {
        return;
    };
    assert!(is_sound(&state.covariance), "{what}: {}", state.covariance);
    let x = &state.nominal;
    let norm = x.world_from_body.rotation.norm();
    assert!((norm - 1.0).abs() < 1e-9, "{what}: norm {norm}");
    let vectors = [
        x.world_from_body.translation,
        x.velocity_m_s,
        x.gyro_bias_rad_s,
        x.accel_bias_m_s2,
    ];
    assert!(vectors.iter().flatten().all(|v| v.is_finite()), "{what}");
}

#[test]
fn spike_of_gyro_or_accelerometer_of_any_size_hardly_moves_the_state() {
    for (which, size) in [
        (0, 1.5),
        (0, 20.0),
        (0, 200.0),
        (0, 1e160),
        (1, 22.0),
        (1, 300.0),
        (1, 1e3),
        (1, 3.3e4),
        (1, 1e300),
    ] {
        let (mut tour, mut clean, mut spiked) = (Tour::new(3), filter(), filter());
        let (mut angle, mut speed) = (0.0_f64, 0.0_f64);
        for step in 0..3000 {
            let sample = tour.imu(step);
            let stamp = sample.stamp;
            clean.push_imu(&sample);
            let mut spoilt = sample;
            if step == 1500 {
                [&mut spoilt.gyro_rad_s, &mut spoilt.accel_m_s2][which].x += size;
            }
            spiked.push_imu(&spoilt);
            if step % 7 == 0 && step < 1400 {
                let pose = tour.pose(step);
                for filter in [&mut clean, &mut spiked] {
                    filter.push_pose(stamp, &pose, &pose_covariance());
                }
            }
            let (a, b) = (clean.state(stamp).unwrap(), spiked.state(stamp).unwrap());
            let (a, b) = (a.nominal, b.nominal);
            if step < 1700 {
                let apart = a
                    .world_from_body
                    .rotation
                    .angle_to(&b.world_from_body.rotation);
                angle = angle.max(apart.to_degrees());
                // A second later the tilt has made a velocity of its own.
                speed = speed.max((a.velocity_m_s - b.velocity_m_s).norm());
            }
            if step == 1500 {
                sound(&spiked, stamp, "spike");
            }
        }
        assert!(angle < SPIKE_DEG, "sensor {which}, {size:e}: {angle} deg");
        let tilted = 9.81 * SPIKE_DEG.to_radians();
        assert!(
            speed < SPIKE_M_S + tilted,
            "sensor {which}, {size:e}: {speed} m/s"
        );
    }
}

#[test]
fn covariance_after_gaps_of_any_length_is_positive_and_vision_is_believed_again() {
    for gap_s in [0.2, 2.0, 30.0, 3600.0, 86_400.0, 1e7] {
        let (mut tour, mut filter) = (Tour::new(4), filter());
        let late = |step: usize| {
            let gap_ns = if step < 600 { 0 } else { (gap_s * 1e9) as i64 };
            Stamp::from_ns(Tour::stamp(step).ns() + gap_ns)
        };
        for step in 0..2000 {
            let sample = ImuSample {
                stamp: late(step),
                ..tour.imu(step)
            };
            filter.push_imu(&sample);
            sound(&filter, sample.stamp, &format!("{gap_s} s, step {step}"));
            if step == 600 && gap_s > 1.0 {
                let state = filter.state(sample.stamp).unwrap();
                let lost = state.covariance.fixed_view::<3, 3>(P0, P0).trace().sqrt();
                // What could have been gone meanwhile, at a walk.
                assert!(lost > 0.3 * gap_s, "{gap_s}: {lost} m");
            }
            if step % 7 == 0 && step != 600 {
                let pose = tour.pose(step);
                filter.push_pose(sample.stamp, &pose, &pose_covariance());
            }
        }
        let state = filter.state(late(1999)).unwrap();
        let off = error(&tour, 1999, &state);
        assert!(off.fixed_rows::<3>(6).norm() < 0.1, "{gap_s}: {off}");
        assert!(off.fixed_rows::<3>(0).norm() < 0.05, "{gap_s}: {off}");
        assert!(state.status == Status::Ok, "{gap_s}: {}", state.status);
    }
}
const P0: usize = 6;

#[test]
fn hour_without_any_measurement_leaves_a_positive_covariance() {
    let (mut tour, mut filter) = (Tour::new(5), filter());
    for step in 0..720_000 {
        let sample = tour.imu(step);
        filter.push_imu(&sample);
        if step % 5000 == 0 {
            sound(&filter, sample.stamp, &format!("step {step}"));
        }
    }
    let state = filter.state(Tour::stamp(719_999)).unwrap();
    let velocity = state.nominal.velocity_m_s.norm();
    assert!(velocity < 150.0, "{velocity} m/s");
}

#[test]
fn hour_of_flaws_of_any_size_leaves_a_positive_covariance() {
    let (mut tour, mut filter) = (Tour::new(6), filter());
    let mut flaws = Flaws::new(7, 0.02);
    let mut now_ns: i64 = 0;
    for step in 0..720_000 {
        let mut sample = tour.imu(step);
        let step_s = flaws.step(DT_S);
        let by = if step_s.is_finite() {
            step_s.clamp(-1.0, 1e5)
        } else {
            0.0
        };
        now_ns += (by * 1e9) as i64;
        sample.stamp = Stamp::from_ns(now_ns);
        flaws.vector(&mut sample.gyro_rad_s);
        flaws.vector(&mut sample.accel_m_s2);
        filter.push_imu(&sample);
        if step % 7 == 0 {
            let (mut pose, mut velocity) = (tour.pose(step), tour.velocity(step));
            flaws.vector(&mut pose.translation);
            flaws.vector(&mut velocity);
            let (mut poses, mut speeds) = (pose_covariance(), speed_covariance());
            if flaws.strikes() {
                poses *= flaws.number();
            }
            if flaws.strikes() {
                speeds[(0, 1)] = flaws.number();
            }
            filter.push_pose(sample.stamp, &pose, &poses);
            filter.push_velocity(sample.stamp, &velocity, &speeds);
        }
        if step % 11 == 0 {
            let mut mag = tour.truth(step).rotation.inverse() * Vector3::new(5.0, 43.0, 20.0);
            flaws.vector(&mut mag);
            filter.push_mag(sample.stamp, &mag);
            if flaws.strikes() {
                filter.push_zero_velocity(sample.stamp, flaws.number());
            }
        }
        if step % 10 == 0 {
            sound(&filter, sample.stamp, &format!("step {step}"));
        }
    }
    assert!(filter.refused() > 10_000, "{}", filter.refused());
}

#[test]
fn position_observer_through_spikes_and_flaws_stays_finite() {
    let q = UnitQuaternion::identity();
    let new = || {
        PositionObserver::new(
            PositionGains::default(),
            DOWN,
            Vector3::zeros(),
            Vector3::zeros(),
        )
        .unwrap()
    };
    for (which, size) in [
        (0, 200.0),
        (1, 300.0),
        (1, 1e6),
        (2, 40.0),
        (3, 1e9),
        (3, 1e300),
    ] {
        let mut observer = new();
        for i in 0..2000 {
            let mut v = [Vector3::zeros(), -DOWN, Vector3::zeros(), Vector3::zeros()];
            if i == 1000 {
                v[which].x += size;
            }
            observer.step(&v[0], &v[1], &q, Some(&v[2]), Some(&v[3]), DT_S);
            let off = observer.position().norm() + observer.velocity().norm();
            assert!(off < 1e-9, "{which}, {size:e}: {off}");
        }
    }
    let (mut observer, mut flaws) = (new(), Flaws::new(8, 0.02));
    for i in 0..720_000 {
        let mut v = [Vector3::zeros(), -DOWN, Vector3::zeros(), Vector3::zeros()];
        v.iter_mut().for_each(|v| flaws.vector(v));
        observer.step(&v[0], &v[1], &q, Some(&v[2]), Some(&v[3]), flaws.step(DT_S));
        let off = observer.position().norm() + observer.velocity().norm();
        assert!(off.is_finite(), "step {i}: {off}");
    }
}
