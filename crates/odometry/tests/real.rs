//! Real recordings: drift against motion capture and against a dense reconstruction.
//!
//! They run where `SPHEREFLOW_DATA` names the folder of the recordings, and print their figures:
//! `cargo test -p sphereflow-odometry --release --test real -- --nocapture --test-threads 1`.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use sphereflow_core::{Pose, Stamp, TrackStatus};
use sphereflow_io::{OpenOptions, Recording, open_recording};
use sphereflow_odometry::{Config, DepthOdometry, OdometryResult, twist_from_pose};
use std::path::Path;

/// Truth further apart than this is a gap, seconds.
const TRUTH_GAP_S: f64 = 0.05;

fn open(folder: &str) -> Option<Recording> {
    let Some(root) = std::env::var_os("SPHEREFLOW_DATA") else {
        println!("skipped: SPHEREFLOW_DATA is not set");
        return None;
    };
    Some(open_recording(&Path::new(&root).join(folder), &OpenOptions::default()).unwrap())
}

/// A run with, frame by frame, the truth where it is known.
struct Run {
    results: Vec<OdometryResult>,
    truth: Vec<Option<Pose>>,
}

fn run(recording: &Recording, config: Config) -> Run {
    let mut odometry = DepthOdometry::new(recording.camera().unwrap(), config).unwrap();
    let truth = recording.truth().unwrap();
    let results: Vec<OdometryResult> = (0..recording.len())
        .map(|i| {
            let frame = recording.frame(i).unwrap();
            odometry
                .push(frame.depth.as_ref().unwrap(), frame.stamp)
                .unwrap()
        })
        .collect();
    let truth = results
        .iter()
        .map(|r| truth.interpolate(r.stamp, TRUTH_GAP_S))
        .collect();
    Run { results, truth }
}

/// What a run is judged by.
struct Figures {
    /// Rms distance of the positions after alignment.
    ate_m: f64,
    /// Rms error of the motions over 30 frames.
    second_m: f64,
    second_rad: f64,
    /// Median error of the motions between frames.
    frame_m: f64,
    frame_rad: f64,
    lost: usize,
}

impl Run {
    fn figures(&self, name: &str) -> Figures {
        let pairs = self.results.iter().zip(&self.truth);
        let known = pairs.filter_map(|(r, t)| t.map(|t| (r.world_from_camera, t)));
        let (estimated, truth): (Vec<Pose>, Vec<Pose>) = known.unzip();
        let (second_m, second_rad) = relative_errors(&estimated, &truth, 30);
        let (frame_m, frame_rad) = relative_errors(&estimated, &truth, 1);
        let is_lost = |r: &&OdometryResult| matches!(r.status, TrackStatus::Lost(_));
        let figures = Figures {
            ate_m: trajectory_error(&estimated, &truth),
            second_m: rms(&second_m),
            second_rad: rms(&second_rad),
            frame_m: median(frame_m),
            frame_rad: median(frame_rad),
            lost: self.results.iter().filter(is_lost).count(),
        };
        let Figures {
            ate_m,
            second_m,
            second_rad,
            frame_m,
            frame_rad,
            lost,
        } = figures;
        println!(
            "{name}: {} frames, {lost} lost, ATE {ate_m:.4} m; 1 s RPE {second_m:.4} m \
             {second_rad:.4} rad; frame {frame_m:.4} m {frame_rad:.4} rad; {:.2} ms a frame; squared \
             error over covariance {:.1} (median, 5.3 is ideal)",
            estimated.len(),
            self.milliseconds(),
            median(self.normalised_errors()),
        );
        figures
    }

    fn milliseconds(&self) -> f64 {
        let times = self.results.iter().map(|r| r.timings);
        median(
            times
                .map(|t| (t.averaging_s + t.estimation_s) * 1e3)
                .collect(),
        )
    }

    /// Squared errors of the measured twists in units of their covariance.
    fn normalised_errors(&self) -> Vec<f64> {
        let mut errors = Vec::new();
        let mut before: Option<(Stamp, Pose)> = None;
        for (result, truth) in self.results.iter().zip(&self.truth) {
            if matches!(result.status, TrackStatus::Skipped(_)) {
                continue;
            }
            if let (Some((start, from)), Some(to)) = (before, truth)
                && let (Some(twist), Some(covariance)) = (result.twist, result.covariance)
            {
                let dt_s = result.stamp.seconds_since(start);
                let error =
                    twist.vector() - twist_from_pose(&(from.inverse() * *to), dt_s).vector();
                errors.push(error.dot(&(covariance.try_inverse().unwrap() * error)));
            }
            before = truth.map(|truth| (result.stamp, truth));
        }
        errors
    }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Errors of the motions over `step` frames: metres and radians.
fn relative_errors(estimated: &[Pose], truth: &[Pose], step: usize) -> (Vec<f64>, Vec<f64>) {
    let motion = |poses: &[Pose], i: usize| poses[i].inverse() * poses[i + step];
    (0..truth.len() - step)
        .map(|i| motion(estimated, i).distance_and_angle(&motion(truth, i)))
        .unzip()
}

/// Rms distance of the positions after the best rigid alignment (Umeyama, no scale), metres.
fn trajectory_error(estimated: &[Pose], truth: &[Pose]) -> f64 {
    let n = truth.len() as f64;
    let mean = |poses: &[Pose]| poses.iter().map(|p| p.translation).sum::<Vector3<f64>>() / n;
    let (from, to) = (mean(estimated), mean(truth));
    let pairs = || {
        estimated
            .iter()
            .zip(truth)
            .map(|(e, t)| (e.translation - from, t.translation - to))
    };
    let covariance: Matrix3<f64> = pairs().map(|(e, t)| t * e.transpose()).sum();
    let svd = covariance.svd(true, true);
    let (u, v_t) = (svd.u.unwrap(), svd.v_t.unwrap());
    let mut signs = Vector3::repeat(1.0);
    signs.z = (u * v_t).determinant().signum();
    let rotation = u * Matrix3::from_diagonal(&signs) * v_t;
    let rotation =
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    (pairs()
        .map(|(e, t)| (rotation * e - t).norm_squared())
        .sum::<f64>()
        / n)
        .sqrt()
}

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
