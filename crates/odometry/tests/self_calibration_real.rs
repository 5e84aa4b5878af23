//! Self-calibration of real Kinects from their motion, without any truth.
//!
//! Runs where `SPHEREFLOW_DATA` names the folder of the recordings, and prints what it finds:
//! `cargo test -p sphereflow-odometry --release --test self_calibration_real -- --nocapture
//! --test-threads 1`.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

use sphereflow_io::{OpenOptions, open_recording};
use sphereflow_odometry::{
    CalibrationStatus, SelfCalibration, SelfCalibrationConfig, SelfCalibrator,
};
use std::path::Path;
use std::time::Instant;

fn calibrate(folder: &str, config: SelfCalibrationConfig) -> Option<SelfCalibration> {
    let Some(root) = std::env::var_os("SPHEREFLOW_DATA") else {
        println!("skipped: SPHEREFLOW_DATA is not set");
        return None;
    };
    let options = OpenOptions::default();
    let recording = open_recording(&Path::new(&root).join(folder), &options).unwrap();
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
    print_report(folder, &found);
    println!("  {collected_s:.1} s to track, {solved_s:.1} s to solve");
    Some(found)
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
        println!("  {:<16} {:>9.5} +- {:.5} of {:.5}{mark}", p.name, p.value, p.std, p.prior_std);
    }
    for held in &found.held {
        println!("  held at {:.2} of the prior: {:?}", held.std_share, held.shares);
    }
}

#[test]
fn tum_rpy_calibration_lowers_the_residual() {
    let Some(found) = calibrate("tum-fr1-rpy-a", SelfCalibrationConfig::default()) else {
        return;
    };
    assert_eq!(found.status, CalibrationStatus::Calibrated);
}

#[test]
fn tum_rpy_readout_alone() {
    let Some(found) = calibrate("tum-fr1-rpy-a", SelfCalibrationConfig::readout_only()) else {
        return;
    };
    assert_eq!(found.status, CalibrationStatus::Calibrated);
}

#[test]
fn seven_scenes_kitchen_calibration_lowers_the_residual() {
    let Some(found) = calibrate("sevenscenes-kitchen-a", SelfCalibrationConfig::default()) else {
        return;
    };
    assert_eq!(found.status, CalibrationStatus::Calibrated);
}
