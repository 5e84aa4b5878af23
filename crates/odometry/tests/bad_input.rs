//! Input that no camera should give: an error or a status with a reason, never a pose that is
//! claimed to be measured.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

#[path = "../../alignment/tests/scene/mod.rs"]
mod scene;

use nalgebra::{UnitQuaternion, Vector3};
use scene::{DT_S, Scene, pinhole, somewhere, twist};
use sphereflow_alignment::{Config, VelocityEstimate, estimate_velocity, pose_from_twist};
use sphereflow_core::{DepthMap, Plane, Pose, Reason, Stamp, TrackStatus, Twist};
use sphereflow_odometry::{DepthOdometry, OdometryConfig};

const FRAME_NS: i64 = 33_333_333;

fn filled(metres: f32) -> DepthMap {
    DepthMap::new(Plane::filled(320, 240, metres))
}

fn motion() -> Twist {
    twist([0.3, -0.4, 0.2, 0.25, -0.1, 0.3])
}

/// View after `time_s` of the motion.
fn view(time_s: f64) -> DepthMap {
    Scene::room().depths(
        &pinhole(),
        &(somewhere() * pose_from_twist(&motion(), time_s)),
    )
}

fn estimate(first: &DepthMap, second: &DepthMap, dt_s: f64) -> VelocityEstimate {
    estimate_velocity(&pinhole(), first, second, dt_s, &Config::default()).unwrap()
}

/// Status of the second of two frames.
fn pushed(first: &DepthMap, second: &DepthMap, after_ns: i64) -> TrackStatus {
    let mut odometry = DepthOdometry::new(&pinhole(), OdometryConfig::default()).unwrap();
    odometry.push(first, Stamp::from_ns(0)).unwrap();
    let found = odometry.push(second, Stamp::from_ns(after_ns)).unwrap();
    assert_eq!(
        found.twist.is_some(),
        matches!(found.status, TrackStatus::Tracked | TrackStatus::Weak(_))
    );
    found.status
}

#[test]
fn depth_without_a_valid_number_is_lost() {
    for metres in [f32::NAN, 0.0, -1.5, f32::INFINITY, f32::NEG_INFINITY] {
        for (first, second) in [(filled(metres), view(0.0)), (view(0.0), filled(metres))] {
            let found = estimate(&first, &second, DT_S);
            let lost = TrackStatus::Lost(Reason::FewKnownPixels { share: 0.0 });
            assert_eq!((found.status, found.twist), (lost, None), "{metres}");
        }
        let lost = TrackStatus::Lost(Reason::FewKnownPixels { share: 0.0 });
        assert_eq!(
            pushed(&view(0.0), &filled(metres), FRAME_NS),
            lost,
            "{metres}"
        );
    }
}

/// Pixels that cannot be are unknown, and the rest is measured as if they were holes.
#[test]
fn depth_with_some_impossible_numbers_is_measured_without_them() {
    let spoilt = |time_s: f64, bad: f32| {
        let mut plane = view(time_s).into_plane();
        for (i, z) in plane.data_mut().iter_mut().enumerate() {
            if i % 7919 < 700 {
                *z = bad;
            }
        }
        plane
    };
    let holes = estimate(
        &DepthMap::new(spoilt(0.0, f32::NAN)),
        &DepthMap::new(spoilt(DT_S, f32::NAN)),
        DT_S,
    );
    assert_eq!(holes.status, TrackStatus::Tracked);
    for bad in [0.0, -2.0, f32::INFINITY, f32::NEG_INFINITY] {
        let (first, second) = (
            DepthMap::new(spoilt(0.0, bad)),
            DepthMap::new(spoilt(DT_S, bad)),
        );
        assert_eq!(estimate(&first, &second, DT_S), holes, "{bad}");
        assert_eq!(
            pushed(&first, &second, FRAME_NS),
            TrackStatus::Tracked,
            "{bad}"
        );
    }
}

#[test]
fn depth_that_is_the_same_everywhere_is_weak_and_a_repeated_image_is_skipped() {
    let found = estimate(&filled(2.0), &filled(2.0), DT_S);
    assert!(
        matches!(found.status, TrackStatus::Weak(Reason::Unobservable { .. })),
        "{}",
        found.status
    );
    let std = found.covariance.unwrap().diagonal().map(f64::sqrt);
    // x, y and the turn about z are unknown, and claimed to be
    assert!(std[2] > 0.2 && std[3] > 0.5 && std[4] > 0.5, "{std}");
    let status = pushed(&filled(2.0), &filled(2.0), FRAME_NS);
    assert_eq!(status, TrackStatus::Skipped(Reason::DuplicateFrame));
    let status = pushed(&filled(2.0), &filled(1.99), FRAME_NS);
    assert!(matches!(status, TrackStatus::Weak(_)), "{status}");
}

#[test]
fn time_that_does_not_pass_is_an_error_or_a_skipped_frame() {
    for dt_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = estimate_velocity(
            &pinhole(),
            &view(0.0),
            &view(DT_S),
            dt_s,
            &Config::default(),
        );
        let error = error.unwrap_err().to_string();
        assert!(
            error.starts_with("dt_s") && error.contains("positive"),
            "{error}"
        );
    }
    for after_ns in [0, -FRAME_NS] {
        let status = pushed(&view(0.0), &view(DT_S), after_ns);
        assert_eq!(status, TrackStatus::Skipped(Reason::StampNotIncreasing));
    }
}

/// A second is long: two images are measured where they still overlap, as the caller says what
/// belongs together; the odometry does not believe that a velocity lasts for longer than its gap.
#[test]
fn time_of_a_second_is_measured_in_a_pair_and_a_gap_in_the_odometry() {
    let slow = twist([0.05, -0.04, 0.02, 0.1, -0.05, 0.08]);
    let view = |time_s: f64| {
        Scene::room().depths(&pinhole(), &(somewhere() * pose_from_twist(&slow, time_s)))
    };
    let found = estimate(&view(0.0), &view(1.0), 1.0);
    println!("a second, slow: {}", found.status);
    let error = (found.twist.unwrap().vector() - slow.vector()).norm();
    assert!(
        found.status.has_pose() && error < 1e-3,
        "{} {error}",
        found.status
    );
    let status = pushed(&view(0.0), &view(1.0), 1_000_000_000);
    assert_eq!(status, TrackStatus::Lost(Reason::Gap { seconds: 1.0 }));
}

#[test]
fn frames_that_do_not_overlap_are_lost() {
    for turn in [1.2, 2.0, 3.1, -1.6] {
        let away = Pose::new(
            UnitQuaternion::from_euler_angles(0.0, turn, 0.0),
            Vector3::new(-0.5, 0.2, -0.8),
        );
        let other = Scene::room().depths(&pinhole(), &away);
        let found = estimate(&view(0.0), &other, DT_S);
        println!("turned by {turn}: {}", found.status);
        assert!(
            matches!(found.status, TrackStatus::Lost(_)) && found.twist.is_none(),
            "{}",
            found.status
        );
        let status = pushed(&view(0.0), &other, FRAME_NS);
        assert!(matches!(status, TrackStatus::Lost(_)), "{status}");
    }
}

#[test]
fn frames_of_other_sizes_are_errors_that_name_them() {
    let small = DepthMap::new(Plane::filled(160, 120, 2.0));
    let config = Config::default();
    for (first, second, name) in [
        (&small, &view(0.0), "depth0"),
        (&view(0.0), &small, "depth1"),
    ] {
        let error = estimate_velocity(&pinhole(), first, second, DT_S, &config).unwrap_err();
        let text = error.to_string();
        assert!(
            text.starts_with(name) && text.contains("320x240") && text.contains("160x120"),
            "{text}"
        );
    }
    let mut odometry = DepthOdometry::new(&pinhole(), OdometryConfig::default()).unwrap();
    let error = odometry
        .push(&small, Stamp::from_ns(0))
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("depth") && error.contains("320x240") && error.contains("160x120"),
        "{error}"
    );
}
