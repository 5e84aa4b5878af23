//! Bad input is an error, useless input a status with a reason, and neither is ever an answer.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

mod scene;

use scene::{DT_S, Scene, pinhole, somewhere, twist};
use sphereflow_core::{DepthMap, Plane, Pose, Reason, Stamp, TrackStatus, Twist};
use sphereflow_odometry::{
    Config, DepthOdometry, OdometryConfig, OdometryResult, estimate_velocity, pose_from_twist,
};

const FRAME_NS: i64 = 33_333_333;

fn filled(width: usize, height: usize, metres: f32) -> DepthMap {
    DepthMap::new(Plane::filled(width, height, metres))
}

fn motion() -> Twist {
    twist([0.3, -0.4, 0.2, 0.25, -0.1, 0.3])
}

/// Pose of frame `i` of a constant motion; the world is the first camera.
fn pose_at(i: i64) -> Pose {
    pose_from_twist(&motion(), i as f64 * FRAME_NS as f64 * 1e-9)
}

fn view(i: i64) -> DepthMap {
    Scene::room().depths(&pinhole(), &(somewhere() * pose_at(i)))
}

fn push(odometry: &mut DepthOdometry, depth: &DepthMap, i: i64) -> OdometryResult {
    odometry.push(depth, Stamp::from_ns(i * FRAME_NS)).unwrap()
}

fn odometry() -> DepthOdometry {
    DepthOdometry::new(&pinhole(), OdometryConfig::default()).unwrap()
}

/// Exact depth over a few frames, metres and radians.
fn assert_near(found: &Pose, expected: &Pose) {
    let (d, a) = found.distance_and_angle(expected);
    assert!(d < 1e-3 && a < 1e-3, "{d} m, {a} rad");
}

#[test]
fn estimate_with_bad_arguments_is_an_error_that_names_them() {
    let (camera, good) = (pinhole(), view(0));
    for dt_s in [0.0, -0.1, f64::NAN, f64::INFINITY] {
        let error = estimate_velocity(&camera, &good, &good, dt_s, &Config::default()).unwrap_err();
        assert!(error.to_string().contains("dt_s"), "{error}");
    }
    let small = filled(160, 120, 2.0);
    let error = estimate_velocity(&camera, &good, &small, DT_S, &Config::default()).unwrap_err();
    let text = error.to_string();
    assert!(
        text.contains("depth1") && text.contains("320x240") && text.contains("160x120"),
        "{text}"
    );
    let config = Config {
        block: 0,
        ..Config::default()
    };
    let error = estimate_velocity(&camera, &good, &good, DT_S, &config).unwrap_err();
    assert!(error.to_string().contains("block"), "{error}");
}

#[test]
fn estimate_without_depth_is_lost_and_has_no_twist() {
    for nothing in [filled(320, 240, f32::NAN), filled(320, 240, 0.0)] {
        let lost =
            estimate_velocity(&pinhole(), &nothing, &view(0), DT_S, &Config::default()).unwrap();
        let few = TrackStatus::Lost(Reason::FewKnownPixels { share: 0.0 });
        assert_eq!(
            (lost.status, lost.twist, lost.covariance),
            (few, None, None)
        );
    }
}

#[test]
fn estimate_with_depth_in_a_strip_only_has_too_few_domains() {
    let strip = |i: i64| {
        let mut metres = view(i).into_plane();
        metres.data_mut()[320 * 28..].fill(f32::NAN);
        DepthMap::new(metres)
    };
    let lost =
        estimate_velocity(&pinhole(), &strip(0), &strip(1), DT_S, &Config::default()).unwrap();
    let few = matches!(
        lost.status,
        TrackStatus::Lost(Reason::FewDomains { needed: 40, .. })
    );
    assert!(few && lost.twist.is_none(), "{}", lost.status);
}

#[test]
fn estimate_of_constant_depth_is_weak_not_at_rest() {
    let wall = filled(320, 240, 2.0);
    let weak = estimate_velocity(&pinhole(), &wall, &wall, DT_S, &Config::default()).unwrap();
    assert!(
        matches!(weak.status, TrackStatus::Weak(Reason::Unobservable { .. })),
        "{}",
        weak.status
    );
    assert_eq!(
        weak.weak_directions.iter().filter(|d| !d.estimated).count(),
        3
    );
}

#[test]
fn estimate_of_unrelated_images_is_lost() {
    for (turn, y) in [(1.9, 0.6), (0.9, -0.3), (-1.2, 0.2), (2.8, 0.0)] {
        let elsewhere = Pose::new(
            nalgebra::UnitQuaternion::from_euler_angles(0.0, turn, 0.0),
            nalgebra::Vector3::new(-0.9, y, -1.0),
        );
        let other = Scene::room().depths(&pinhole(), &elsewhere);
        let lost =
            estimate_velocity(&pinhole(), &view(0), &other, DT_S, &Config::default()).unwrap();
        let is_lost = matches!(lost.status, TrackStatus::Lost(_)) && lost.twist.is_none();
        println!("{turn}: {}", lost.status);
        assert!(is_lost, "{turn}: {}", lost.status);
    }
}

#[test]
fn odometry_follows_an_exact_motion_with_unit_quaternions() {
    let mut odometry = odometry();
    for i in 0..20 {
        let result = push(&mut odometry, &view(i), i);
        let expected = if i == 0 {
            TrackStatus::Started
        } else {
            TrackStatus::Tracked
        };
        assert_eq!((result.status, result.segment), (expected, 0));
        assert_near(&result.world_from_camera, &pose_at(i));
        assert!((result.world_from_camera.rotation.norm() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn odometry_skips_duplicates_and_stamps_that_do_not_increase() {
    let mut odometry = odometry();
    push(&mut odometry, &view(0), 0);
    push(&mut odometry, &view(1), 1);
    let duplicate = push(&mut odometry, &view(1), 2);
    assert_eq!(
        duplicate.status,
        TrackStatus::Skipped(Reason::DuplicateFrame)
    );
    assert_near(&duplicate.world_from_camera, &pose_at(1));
    assert!(duplicate.status.has_pose(), "the same image, the same pose");
    let late = push(&mut odometry, &view(2), 2);
    assert_eq!(
        late.status,
        TrackStatus::Skipped(Reason::StampNotIncreasing)
    );
    // The step after a duplicate is measured over the time since its image was new.
    let next = push(&mut odometry, &view(3), 3);
    assert_eq!(next.status, TrackStatus::Tracked);
    assert_near(&next.world_from_camera, &pose_at(3));
}

#[test]
fn odometry_bridges_blind_frames_and_marks_them_lost() {
    let mut odometry = odometry();
    push(&mut odometry, &view(0), 0);
    push(&mut odometry, &view(1), 1);
    let blind = push(&mut odometry, &filled(320, 240, f32::NAN), 2);
    assert_eq!(
        blind.status,
        TrackStatus::Lost(Reason::FewKnownPixels { share: 0.0 })
    );
    assert_eq!((blind.twist, blind.covariance), (None, None));
    assert_near(&blind.world_from_camera, &pose_at(2)); // constant velocity, and it was
    let missing = odometry.push_without_depth(Stamp::from_ns(3 * FRAME_NS));
    assert_eq!(missing.status, TrackStatus::Lost(Reason::NoDepth));
    let next = push(&mut odometry, &view(4), 4);
    assert_eq!((next.status, next.segment), (TrackStatus::Tracked, 0));
    assert_near(&next.world_from_camera, &pose_at(4));
}

#[test]
fn odometry_after_a_long_gap_says_so_and_opens_a_segment() {
    let mut odometry = odometry();
    push(&mut odometry, &view(0), 0);
    push(&mut odometry, &view(1), 1);
    let gap = push(&mut odometry, &view(40), 40);
    let is_gap = matches!(gap.status, TrackStatus::Lost(Reason::Gap { seconds }) if (seconds - 1.3).abs() < 1e-3);
    assert!(
        is_gap && gap.segment == 1 && gap.twist.is_none(),
        "{}",
        gap.status
    );
    let after = push(&mut odometry, &view(41), 41);
    assert!(
        after.status.has_pose() && after.segment == 1,
        "{}",
        after.status
    );
}

#[test]
fn odometry_that_begins_blind_is_lost_until_it_sees() {
    let mut odometry = odometry();
    let blind = push(&mut odometry, &filled(320, 240, f32::NAN), 0);
    assert!(!blind.status.has_pose());
    assert_eq!(
        push(&mut odometry, &view(0), 1).status,
        TrackStatus::Started
    );
}

#[test]
fn odometry_with_wrong_size_is_an_error_and_changes_nothing() {
    let mut odometry = odometry();
    push(&mut odometry, &view(0), 0);
    let small = filled(160, 120, 2.0);
    let error = odometry
        .push(&small, Stamp::from_ns(FRAME_NS))
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("depth") && error.contains("320x240"),
        "{error}"
    );
    let next = push(&mut odometry, &view(1), 1);
    assert_eq!(next.status, TrackStatus::Tracked);
    assert_near(&next.world_from_camera, &pose_at(1));
}
