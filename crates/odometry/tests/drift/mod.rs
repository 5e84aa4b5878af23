//! Drift of the odometry on a recording: what the tests and the tuning look at.
#![allow(dead_code)] // each program uses its part

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use sphereflow_alignment::twist_from_pose;
use sphereflow_core::{Pose, Stamp, TrackStatus};
use sphereflow_io::{OpenOptions, Recording, open_recording};
use sphereflow_odometry::{DepthOdometry, OdometryConfig, OdometryResult};
use std::path::Path;

/// Truth further apart than this is a gap, seconds.
const TRUTH_GAP_S: f64 = 0.05;

pub fn open(folder: &str) -> Option<Recording> {
    let Some(root) = std::env::var_os("SPHEREFLOW_DATA") else {
        println!("skipped: SPHEREFLOW_DATA is not set");
        return None;
    };
    Some(open_recording(&Path::new(&root).join(folder), &OpenOptions::default()).unwrap())
}

/// A run with, frame by frame, the truth where it is known.
pub struct Run {
    pub results: Vec<OdometryResult>,
    pub truth: Vec<Option<Pose>>,
}

pub fn run(recording: &Recording, config: OdometryConfig) -> Run {
    track(recording, config).1
}

fn track(recording: &Recording, config: OdometryConfig) -> (DepthOdometry, Run) {
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
    (odometry, Run { results, truth })
}

/// What a run is judged by.
pub struct Figures {
    /// Rms distance of the positions after alignment.
    pub ate_m: f64,
    /// Rms error of the motions over 30 frames.
    pub second_m: f64,
    pub second_rad: f64,
    /// Median error of the motions between frames.
    pub frame_m: f64,
    pub frame_rad: f64,
    pub lost: usize,
}

impl Run {
    pub fn figures(&self, name: &str) -> Figures {
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
