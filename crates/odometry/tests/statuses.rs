//! Bad input is an error, useless input a status with a reason, and neither is ever an answer.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

#[path = "../../alignment/tests/scene/mod.rs"]
mod scene;

use scene::{Scene, pinhole, somewhere, twist};
use sphereflow_alignment::pose_from_twist;
use sphereflow_core::{DepthMap, Plane, Pose, Reason, Stamp, TrackStatus, Twist};
use sphereflow_odometry::{DepthOdometry, OdometryConfig, OdometryResult};

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
