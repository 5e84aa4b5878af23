//! Bad input is an error, useless input a status with a reason, and neither is ever an answer.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

mod scene;

use scene::{DT_S, Scene, pinhole, somewhere, twist};
use sphereflow_alignment::{Config, estimate_velocity, pose_from_twist};
use sphereflow_core::{DepthMap, Plane, Pose, Reason, TrackStatus, Twist};

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
