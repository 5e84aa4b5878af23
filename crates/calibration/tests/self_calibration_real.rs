//! Self-calibration of real Kinects from their motion, without any truth.
//!
//! Runs where `SPHEREFLOW_DATA` names the folder of the recordings, and prints what it finds:
//! `cargo test -p sphereflow-calibration --release --test self_calibration_real -- --nocapture
//! --test-threads 1`.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

#[path = "../../odometry/tests/drift/mod.rs"]
mod drift;

use sphereflow_calibration::{
    CalibratedParameter, CalibrationStatus, SelfCalibration, SelfCalibrationConfig, SelfCalibrator,
};
use sphereflow_io::{OpenOptions, Recording, open_recording};
use sphereflow_odometry::OdometryConfig;
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
    calibration.depth_field = Some(found.correction);
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

fn parameter<'a>(found: &'a SelfCalibration, name: &str) -> &'a CalibratedParameter {
    found.parameters.iter().find(|p| p.name == name).unwrap()
}

/// The colour lens over-corrects the registered depth, and the rows are read in 30 ms: nothing of
/// it comes from the truth.
#[test]
fn tum_rpy_calibration_lowers_residual_and_drift() {
    let Some(recording) = drift::open("tum-fr1-rpy-a") else {
        return;
    };
    let found = calibrate("tum", &recording, SelfCalibrationConfig::default());
    assert_eq!(found.status, CalibrationStatus::Calibrated);
    assert!(found.residual_after < 0.85 * found.residual_before);
    assert!((found.readout_s - 0.03).abs() < 5e-3, "{}", found.readout_s);
    assert!(parameter(&found, "readout_s").observable);
    let k1 = parameter(&found, "k1").value;
    assert!((-0.15..-0.03).contains(&k1), "{k1}");
    // The tilt of 1/Z, of both fields together, at the 1.3 m of this scene.
    let tilt =
        parameter(&found, "relative.z1").value / 1.3 + parameter(&found, "additive.z1").value;
    assert!((-0.04..-0.01).contains(&tilt), "{tilt}");

    let plain = with_readout("as it is", &recording, 0.0);
    let shutter = with_readout("rolling shutter", &recording, found.readout_s);
    let all = odometry("rolling shutter and calibration", &recording, &found);
    assert!(all.ate_m <= 0.015, "{}", all.ate_m);
    assert!(all.ate_m < 0.8 * shutter.ate_m && shutter.ate_m < 0.8 * plain.ate_m);
    assert_eq!(all.lost, 0);
}

#[test]
fn tum_rpy_readout_alone_is_thirty_milliseconds() {
    let Some(recording) = drift::open("tum-fr1-rpy-a") else {
        return;
    };
    let found = calibrate("tum", &recording, SelfCalibrationConfig::readout_only());
    assert_eq!(found.status, CalibrationStatus::Calibrated);
    assert!((found.readout_s - 0.03).abs() < 5e-3, "{}", found.readout_s);
    assert!(found.correction.is_identity() && found.rms_rate_rad_s > 0.5);
}

/// Its truth was made from the same uncorrected depth, so that only the residual tells.
#[test]
fn seven_scenes_kitchen_calibration_lowers_the_residual() {
    let Some(recording) = drift::open("sevenscenes-kitchen-a") else {
        return;
    };
    let found = calibrate("kitchen", &recording, SelfCalibrationConfig::default());
    assert_eq!(found.status, CalibrationStatus::Calibrated);
    assert!(found.residual_after < 0.9 * found.residual_before);
    let tilt = parameter(&found, "additive.z1").value;
    assert!((-0.05..0.0).contains(&tilt), "{tilt}");
}
