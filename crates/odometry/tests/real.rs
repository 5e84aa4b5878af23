//! Real recordings: drift against motion capture and against a dense reconstruction.
//!
//! They run where `SPHEREFLOW_DATA` names the folder of the recordings, and print their figures:
//! `cargo test -p sphereflow-odometry --release --test real -- --nocapture --test-threads 1`.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

mod drift;

use drift::{open, run};
use sphereflow_core::TrackStatus;
use sphereflow_odometry::{Config, KeyframePolicy, Method, OdometryConfig};

fn single_pass() -> Config {
    Config {
        warps: 0,
        ..Config::default()
    }
}

/// Up to 190 degrees a second, rolling shutter, registered to a distorted image. A camera that
/// never moves has 0.051 m.
#[test]
fn tum_rpy_drift_is_bounded() {
    let Some(recording) = open("tum-fr1-rpy-a") else {
        return;
    };
    let figures = run(&recording, Config::default()).figures("tum fr1_rpy");
    assert!(figures.ate_m < 0.045, "{}", figures.ate_m);
    assert!(figures.second_m < 0.045 && figures.second_rad < 0.07);
    assert!(figures.frame_m < 0.003 && figures.frame_rad < 0.008);
    assert_eq!(figures.lost, 0);
    // Without warping, fast rotation costs twice as much.
    let single = run(&recording, single_pass()).figures("tum fr1_rpy, one pass");
    assert!(
        single.ate_m < 0.1 && single.lost < 4,
        "{} {}",
        single.ate_m,
        single.lost
    );
}

/// Slow motion: one pass is as good. The truth is a reconstruction from the same depth images; a
/// camera that never moves has 0.63 m.
#[test]
fn seven_scenes_kitchen_drift_is_bounded() {
    let Some(recording) = open("sevenscenes-kitchen-a") else {
        return;
    };
    for (name, config) in [
        ("kitchen", Config::default()),
        ("kitchen, one pass", single_pass()),
    ] {
        let figures = run(&recording, config).figures(name);
        assert!(figures.ate_m < 0.06, "{}", figures.ate_m);
        assert!(figures.second_m < 0.035 && figures.second_rad < 0.022);
        assert!(figures.frame_m < 0.0025 && figures.frame_rad < 0.0018);
        assert_eq!(figures.lost, 0);
    }
}

/// Identical images in the recording are left out, and the step after them is not doubled.
#[test]
fn seven_scenes_kitchen_duplicates_are_skipped() {
    let Some(recording) = open("sevenscenes-kitchen-a") else {
        return;
    };
    let run = run(&recording, single_pass());
    let skipped = run
        .results
        .iter()
        .filter(|r| matches!(r.status, TrackStatus::Skipped(_)));
    let count = skipped.count();
    assert!((40..50).contains(&count), "{count}");
}
