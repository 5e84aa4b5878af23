//! Self-calibration of real Kinects from their motion, without any truth.
//!
//! Runs where `SPHEREFLOW_DATA` names the folder of the recordings, and prints what it finds:
//! `cargo test -p sphereflow-odometry --release --test self_calibration_real -- --nocapture
//! --test-threads 1`.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

mod drift;

use sphereflow_io::{OpenOptions, Recording, open_recording};
use sphereflow_odometry::{
    OdometryConfig, SelfCalibration, SelfCalibrationConfig, SelfCalibrator,
};
use std::time::Instant;

fn calibrate(name: &str, recording: &Recording, config: SelfCalibrationConfig) -> SelfCalibration {
    let begin = Instant::now();
    let mut calibrator = SelfCalibrator::new(recording.camera().unwrap(), config).unwrap();
    for i in 0..recording.len() {
        let frame = recording.frame(i).unwrap();
        calibrator
            .push(frame.depth.as_ref().unwrap(), frame.stamp)
            .unwrap();
    }
    let collected_s = begin.elapsed().as_secs_f64();
    let found = calibrator.solve(|_, _| {}).unwrap();
    let solved_s = begin.elapsed().as_secs_f64() - collected_s;
    print_report(name, &found);
    println!("  {collected_s:.1} s to track, {solved_s:.1} s to solve");
    found
}

/// The recording as the calibration sees it, and its odometry.
fn odometry(name: &str, recording: &Recording, found: &SelfCalibration) -> drift::Figures {
    let own = recording.calibration().unwrap();
    let mut calibration = own.with_camera(&found.camera).unwrap();
    calibration.depth_correction = Some(found.correction);
    let options = OpenOptions {
        calibration: Some(calibration),
        ..OpenOptions::default()
    };
    let calibrated = open_recording(recording.path(), &options).unwrap();
    assert!(calibrated.depth_corrected());
    with_readout(name, &calibrated, found.readout_s)
}

fn with_readout(name: &str, recording: &Recording, readout_s: f64) -> drift::Figures {
    let config = OdometryConfig {
        readout_s,
        ..OdometryConfig::default()
    };
    drift::run(recording, config).figures(name)
}

fn print_report(name: &str, found: &SelfCalibration) {
    println!(
        "{name}: {}; {} frames, {} pairs, {} steps; residual {:.3e} -> {:.3e} 1/m; std inflated \
         {:.1} times; {:.2} rad/s, {:.2} m/s rms",
        found.status,
        found.frames,
        found.pairs,
        found.iterations,
        found.residual_before,
        found.residual_after,
        found.inflation,
        found.rms_rate_rad_s,
        found.rms_speed_m_s,
    );
    for p in &found.parameters {
        let mark = if p.observable { "" } else { "  (held)" };
        println!(
            "  {:<16} {:>9.5} +- {:.5} of {:.5}{mark}",
            p.name, p.value, p.std, p.prior_std
        );
    }
    for held in &found.held {
        println!(
            "  held at {:.2} of the prior: {:?}",
            held.std_share, held.shares
        );
    }
}

fn number(name: &str, default: f64) -> f64 {
    std::env::var(name).map_or(default, |v| v.parse().unwrap())
}

#[test]
fn experiment() {
    let folder = std::env::var("FOLDER").unwrap_or("tum-fr1-rpy-a".into());
    let recording = drift::open(&folder).unwrap();
    let config = SelfCalibrationConfig {
        block: number("BLOCK", 4.0) as usize,
        max_pairs: number("PAIRS", 180.0) as usize,
        iterations: number("ITER", 4.0) as usize,
        focal_std: number("FOCAL", 0.01),
        lens_std: number("LENS", 0.03),
        field_std: number("FIELD", 0.02),
        max_turn_rad: number("TURN", 0.6),
        min_motion_m: number("MOTION", 0.05),
        min_gap: number("GAP0", 6.0) as usize,
        max_gap: number("GAP1", 30.0) as usize,
        ..SelfCalibrationConfig::default()
    };
    let found = calibrate(&folder, &recording, config);
    if std::env::var("ALL").is_ok() {
        with_readout("nothing", &recording, 0.0);
        with_readout("rolling shutter", &recording, found.readout_s);
    }
    odometry("all", &recording, &found);
}
