//! Bad samples: a status with a reason, and a state that stays finite.

use super::*;

fn running(steps: usize) -> (Tour, NavigationFilter) {
    let (mut tour, mut filter) = (Tour::new(5), filter());
    for step in 0..steps {
        filter.push_imu(&tour.imu(step));
        if step % 7 == 0 {
            let pose = tour.pose(step);
            filter.push_pose(Tour::stamp(step), &pose, &pose_covariance());
        }
    }
    (tour, filter)
}

#[test]
fn nothing_is_told_before_the_first_reading() {
    let mut filter = filter();
    assert!(filter.state(Stamp::from_ns(0)).is_none());
    let status = filter.push_velocity(Stamp::from_ns(0), &Vector3::zeros(), &Matrix3::identity());
    assert_eq!(status, Status::Starting(Reason::NoData));
}

#[test]
fn samples_that_are_not_finite_or_repeat_are_skipped() {
    let (mut tour, mut filter) = running(1000);
    let before = filter.state(Tour::stamp(999)).unwrap();
    let mut sample = tour.imu(1000);
    sample.accel_m_s2.y = f64::NAN;
    assert_eq!(
        filter.push_imu(&sample),
        Status::Skipped(Reason::NotFinite {
            sensor: Sensor::Accel
        })
    );
    let repeated = tour.imu(999);
    assert_eq!(
        filter.push_imu(&repeated),
        Status::Skipped(Reason::StampNotIncreasing)
    );
    let stamp = Tour::stamp(999);
    let nan = Vector3::repeat(f64::NAN);
    let status = filter.push_velocity(stamp, &nan, &Matrix3::identity());
    assert_eq!(
        status,
        Status::Skipped(Reason::NotFinite {
            sensor: Sensor::Velocity
        })
    );
    let status = filter.push_velocity(stamp, &Vector3::zeros(), &Matrix3::zeros());
    assert!(!status.is_used());
    assert!(!filter.push_zero_velocity(stamp, f64::NAN).is_used());
    assert_eq!(filter.state(stamp).unwrap().nominal, before.nominal);
}

#[test]
fn wrong_pose_is_gated_with_the_reason_and_persistent_ones_win_with_doubt() {
    let (mut tour, mut filter) = running(1000);
    let shift = Vector3::new(0.5, 0.0, 0.0);
    let mut gated = 0;
    let mut last = filter.state(Tour::stamp(999)).unwrap();
    for step in 1000..1600 {
        filter.push_imu(&tour.imu(step));
        if step % 7 != 0 {
            continue;
        }
        let mut pose = tour.pose(step);
        pose.translation += shift;
        let status = filter.push_pose(Tour::stamp(step), &pose, &pose_covariance());
        gated += usize::from(matches!(
            status,
            Status::Skipped(Reason::Gated {
                sensor: Sensor::Pose,
                ..
            })
        ));
        last = filter.state(Tour::stamp(step)).unwrap();
    }
    assert!((20..40).contains(&gated), "{gated} poses gated");
    let off = last.nominal.world_from_body.translation - tour.truth(1596).translation;
    assert!(
        (off - shift).norm() < 0.1,
        "{off:?}: the new place was not taken over"
    );
}

#[test]
fn single_wrong_velocity_does_not_move_the_state() {
    let (mut tour, mut filter) = running(1000);
    filter.push_imu(&tour.imu(1000));
    let before = filter.state(Tour::stamp(1000)).unwrap();
    let wrong = tour.velocity(1000) + Vector3::new(2.0, 0.0, 0.0);
    let status = filter.push_velocity(Tour::stamp(1000), &wrong, &speed_covariance());
    assert!(
        matches!(
            status,
            Status::Skipped(Reason::Gated {
                sensor: Sensor::Velocity,
                ..
            })
        ),
        "{status}"
    );
    assert_eq!(
        filter.state(Tour::stamp(1000)).unwrap().nominal,
        before.nominal
    );
}

#[test]
fn gap_saturation_and_unit_of_g_are_told() {
    let (mut tour, mut filter) = running(1000);
    let late = tour.imu(1200);
    let status = filter.push_imu(&late);
    assert!(
        matches!(status, Status::Weak(Reason::Gap { .. })),
        "{status}"
    );
    let mut fast = tour.imu(1201);
    fast.gyro_rad_s.z = 36.0;
    let status = filter.push_imu(&fast);
    assert!(
        matches!(status, Status::Weak(Reason::Saturated { .. })),
        "{status}"
    );
    let (mut in_g, mut status) = (super::filter(), Status::Ok);
    for step in 0..3000 {
        let mut sample = tour.imu(step);
        sample.accel_m_s2 /= 9.81;
        status = in_g.push_imu(&sample);
    }
    assert!(status.to_string().contains("given in g"), "{status}");
}

#[test]
fn magnet_passing_by_is_left_out() {
    let (mut tour, mut filter) = running(1000);
    let field = Vector3::new(5.0, 43.0, 20.0);
    let mag = |tour: &Tour, step: usize, extra: f64| {
        tour.truth(step).rotation.inverse() * (field + Vector3::x() * extra)
    };
    filter.push_mag(Tour::stamp(999), &mag(&tour, 999, 0.0));
    filter.push_imu(&tour.imu(1000));
    let status = filter.push_mag(Tour::stamp(1000), &mag(&tour, 1000, 60.0));
    assert_eq!(status, Status::Skipped(Reason::MagneticDisturbance));
    let config = NavigationConfig {
        max_delay_s: 0.0,
        ..NavigationConfig::default()
    };
    assert!(
        NavigationFilter::new(config)
            .unwrap_err()
            .to_string()
            .contains("max_delay_s")
    );
}
