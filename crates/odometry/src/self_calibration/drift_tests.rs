//! What a calibration is worth: drift of a keyframe odometry on the calibration's own machinery,
//! which knows rolling shutters, against motion capture.

use super::frames::{Frame, FramePair, velocities};
use super::image_model::ImageModel;
use super::pair_fit::{PairFit, PairRules};
use super::parameters::Calibrated;
use super::*;
use crate::motion::{pose_from_twist, twist_from_pose};
use crate::tiling::Tiling;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3, Vector6};
use sphereflow_core::{Pose, Twist};
use sphereflow_io::{OpenOptions, Recording, open_recording};
use sphereflow_sphere::DepthCorrection;
use std::path::Path;

fn open(folder: &str) -> Option<Recording> {
    let Some(root) = std::env::var_os("SPHEREFLOW_DATA") else {
        println!("skipped: SPHEREFLOW_DATA is not set");
        return None;
    };
    Some(open_recording(&Path::new(&root).join(folder), &OpenOptions::default()).unwrap())
}

/// Poses by alignment to keyframes under a calibration, from frames whose poses only seed nothing.
fn track(frames: &[Frame], calibrated: &Calibrated) -> Vec<Pose> {
    let model = ImageModel::new(calibrated, 4, None).unwrap();
    let rules = PairRules {
        tiling: Tiling::new(model.table.width, model.table.height, 500),
        domain_known_share: 0.3,
        min_domains: 40,
        max_jump: 0.12,
        least_noise: 2e-4,
        largest_noise: 1.0,
    };
    let mut velocity = velocities(frames);
    velocity.iter_mut().for_each(|v| *v = Vector6::zeros());
    let mut poses = vec![Pose::identity()];
    let mut keyframe = 0;
    for i in 1..frames.len() {
        let dt_s = frames[i].stamp.seconds_since(frames[i - 1].stamp);
        velocity[i] = velocity[i - 1];
        let predicted = poses[i - 1] * pose_from_twist(&Twist::from_vector(&velocity[i]), dt_s);
        let mut pose = predicted;
        for (solves, _) in [(3, 0), (2, 1)] {
            let pair = FramePair { first: keyframe, second: i, motion: poses[keyframe].inverse() * pose };
            let mut fit = PairFit::new(&rules, frames, &velocity, &pair).unwrap();
            if let Some(aligned) = fit.align(&model, solves) {
                pose = poses[keyframe] * aligned.motion;
            }
            velocity[i] = twist_from_pose(&(poses[i - 1].inverse() * pose), dt_s).vector();
            if i == 1 {
                velocity[0] = velocity[1];
            }
        }
        poses.push(pose);
        let (distance, angle) =
            (poses[keyframe].inverse() * pose).distance_and_angle(&Pose::identity());
        if angle > 0.22 || distance > 0.2 {
            keyframe = i;
        }
    }
    poses
}

fn trajectory_error(estimated: &[Pose], truth: &[Pose]) -> f64 {
    let n = truth.len() as f64;
    let mean = |poses: &[Pose]| poses.iter().map(|p| p.translation).sum::<Vector3<f64>>() / n;
    let (from, to) = (mean(estimated), mean(truth));
    let pairs = || estimated.iter().zip(truth).map(|(e, t)| (e.translation - from, t.translation - to));
    let covariance: Matrix3<f64> = pairs().map(|(e, t)| t * e.transpose()).sum();
    let svd = covariance.svd(true, true);
    let (u, v_t) = (svd.u.unwrap(), svd.v_t.unwrap());
    let mut signs = Vector3::repeat(1.0);
    signs.z = (u * v_t).determinant().signum();
    let rotation = u * Matrix3::from_diagonal(&signs) * v_t;
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    (pairs().map(|(e, t)| (rotation * e - t).norm_squared()).sum::<f64>() / n).sqrt()
}

#[test]
fn experiment() {
    let folder = std::env::var("FOLDER").unwrap_or("tum-fr1-rpy-a".into());
    let Some(recording) = open(&folder) else { return };
    let camera = recording.camera().unwrap();
    let number = |name: &str, default: f64| std::env::var(name).map_or(default, |v| v.parse().unwrap());
    let config = SelfCalibrationConfig {
        block: number("BLOCK", 4.0) as usize,
        max_pairs: number("PAIRS", 240.0) as usize,
        iterations: number("ITER", 5.0) as usize,
        focal_std: number("FOCAL", 0.01),
        lens_std: number("LENS", 0.03),
        field_std: number("FIELD", 0.02),
        max_turn_rad: number("TURN", 0.6),
        min_motion_m: number("MOTION", 0.05),
        min_gap: number("GAP0", 6.0) as usize,
        max_gap: number("GAP1", 30.0) as usize,
        ..SelfCalibrationConfig::default()
    };
    let mut calibrator = SelfCalibrator::new(camera, config).unwrap();
    let mut c4 = SelfCalibrator::new(camera, SelfCalibrationConfig::default()).unwrap();
    for i in 0..recording.len() {
        let frame = recording.frame(i).unwrap();
        calibrator.push(frame.depth.as_ref().unwrap(), frame.stamp).unwrap();
        c4.push(frame.depth.as_ref().unwrap(), frame.stamp).unwrap();
    }
    let begin = std::time::Instant::now();
    let found = calibrator.solve(|_, _| {}).unwrap();
    println!("{} {} pairs {} steps {:.3e} {:.3e} inflation {:.1} {:.1} s", found.status, found.pairs, found.iterations, found.residual_before, found.residual_after, found.inflation, begin.elapsed().as_secs_f64());
    let text: Vec<String> = found.parameters.iter().map(|p| format!("{} {:.4}+-{:.4}", p.name, p.value, p.std)).collect();
    println!("{}", text.join(", "));
    let truth = recording.truth().unwrap();
    let known: Vec<Option<Pose>> = c4.frames.iter().map(|f| truth.interpolate(f.stamp, 0.05)).collect();
    let identity = DepthCorrection::default();
    for (name, camera, correction, readout_s) in [
        ("nothing", camera, identity, 0.0),
        ("rolling shutter", camera, identity, found.readout_s),
        ("lens", &found.camera, identity, found.readout_s),
        ("all", &found.camera, found.correction, found.readout_s),
        ("all but rolling shutter", &found.camera, found.correction, 0.0),
    ] {
        if std::env::var("ALL").is_err() && name != "all" { continue }
        let calibrated = Calibrated { camera: camera.clone(), correction, readout_s };
        let poses = track(&c4.frames, &calibrated);
        let (e, t): (Vec<Pose>, Vec<Pose>) = poses.iter().zip(&known).filter_map(|(p, k)| k.map(|k| (*p, k))).unzip();
        println!("{name}: ATE {:.4} m", trajectory_error(&e, &t));
    }
}
