//! Real recordings: drift against motion capture and against a dense reconstruction.
//!
//! They run where `SPHEREFLOW_DATA` names the folder of the recordings, and print their figures:
//! `cargo test -p sphereflow-odometry --release --test real -- --nocapture --test-threads 1`.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

mod drift;

use drift::{Run, open, run};
use sphereflow_alignment::{Config, Method};
use sphereflow_core::{Reason, TrackStatus};
use sphereflow_odometry::{KeyframePolicy, OdometryConfig};

/// Share of the frames of a static scene that are said to have two parts which move differently.
fn divided_share(run: &Run) -> f64 {
    let divided =
        |status: &TrackStatus| matches!(status, TrackStatus::Weak(Reason::Divided { .. }));
    let count = run.results.iter().filter(|r| divided(&r.status)).count();
    count as f64 / run.results.len() as f64
}

/// Every frame against the one before, in one robust solve.
fn single_pass() -> OdometryConfig {
    OdometryConfig {
        alignment: Config::of(Method::Single),
        keyframes: KeyframePolicy {
            enabled: false,
            ..KeyframePolicy::default()
        },
        ..OdometryConfig::default()
    }
}

/// Up to 190 degrees a second, rolling shutter, registered to a distorted image. A camera that
/// never moves has 0.051 m.
#[test]
fn tum_rpy_drift_is_bounded() {
    let Some(recording) = open("tum-fr1-rpy-a") else {
        return;
    };
    let global = run(&recording, OdometryConfig::default());
    let divided = divided_share(&global);
    println!("tum fr1_rpy: {:.1} % called divided", 100.0 * divided);
    assert!(divided < 0.03, "{divided}");
    let global = global.figures("tum fr1_rpy");
    assert!(global.ate_m < 0.04, "{}", global.ate_m);
    assert!(global.second_m < 0.045 && global.second_rad < 0.07);
    assert!(global.frame_m < 0.003 && global.frame_rad < 0.008);
    assert_eq!(global.lost, 0);
    let config = OdometryConfig {
        readout_s: 0.03,
        ..OdometryConfig::default()
    };
    let rolling = run(&recording, config).figures("tum fr1_rpy, rolling shutter");
    assert!(rolling.ate_m < 0.022, "{}", rolling.ate_m);
    assert_eq!(rolling.lost, 0);
    // Without warping, fast rotation costs more.
    let single = run(&recording, single_pass()).figures("tum fr1_rpy, one pass");
    assert!(
        single.ate_m < 0.1 && single.lost < 4,
        "{} {}",
        single.ate_m,
        single.lost
    );
}

/// Slow motion: one pass is nearly as good. The truth is a reconstruction from the same depth
/// images; a camera that never moves has 0.63 m.
#[test]
fn seven_scenes_kitchen_drift_is_bounded() {
    let Some(recording) = open("sevenscenes-kitchen-a") else {
        return;
    };
    let first = run(&recording, OdometryConfig::default());
    let divided = divided_share(&first);
    println!("kitchen: {:.1} % called divided", 100.0 * divided);
    assert!(divided < 0.03, "{divided}");
    let figures = first.figures("kitchen");
    assert!(figures.ate_m < 0.045, "{}", figures.ate_m);
    assert!(figures.second_m < 0.03 && figures.second_rad < 0.02);
    assert_eq!(figures.lost, 0);
    let figures = run(&recording, single_pass()).figures("kitchen, one pass");
    assert!(figures.ate_m < 0.06, "{}", figures.ate_m);
    assert!(figures.second_m < 0.035 && figures.second_rad < 0.022);
    assert!(figures.frame_m < 0.0025 && figures.frame_rad < 0.0018);
    assert_eq!(figures.lost, 0);
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
