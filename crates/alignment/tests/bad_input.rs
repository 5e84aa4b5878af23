//! Input that no camera should give: an error or a status with a reason, never a pose that is
//! claimed to be measured.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

mod scene;

use scene::{Scene, pinhole, somewhere, twist};
use sphereflow_alignment::{Config, VelocityEstimate, estimate_velocity, pose_from_twist};
use sphereflow_core::{DepthMap, TrackStatus, Twist};

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

/// The motion of a second at 0.4 m/s and 0.54 rad/s: right, or not claimed.
#[test]
fn time_of_a_second_of_fast_motion_is_right_or_says_why_not() {
    let found = estimate(&view(0.0), &view(1.0), 1.0);
    let error = found
        .twist
        .map(|twist| (twist.vector() - motion().vector()).norm());
    println!("a second, fast: {} {error:?}", found.status);
    assert!(
        found.status != TrackStatus::Tracked || error.unwrap() < 0.01,
        "{error:?}"
    );
}
