//! Real recordings: drift against motion capture and against a dense reconstruction.
//!
//! They run where `SPHEREFLOW_DATA` names the folder of the recordings, and print their figures:
//! `cargo test -p sphereflow-odometry --test real -- --nocapture`.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use sphereflow_core::{DepthMap, Pose, Stamp, Trajectory};
use sphereflow_io::images::{depth_from_raw, read_raw_depth};
use sphereflow_odometry::{Config, DepthOdometry};
use sphereflow_sphere::Camera;
use std::path::{Path, PathBuf};

/// A depth recording with truth.
struct Recording {
    camera: Camera,
    frames: Vec<(Stamp, PathBuf)>,
    depth_scale: f64,
    truth: Trajectory,
}

impl Recording {
    fn depth(&self, index: usize) -> DepthMap {
        let raw = read_raw_depth(&self.frames[index].1).unwrap();
        depth_from_raw(&raw, self.depth_scale).unwrap()
    }
}

fn data(folder: &str) -> Option<PathBuf> {
    let found = std::env::var_os("SPHEREFLOW_DATA").map(|root| Path::new(&root).join(folder));
    if found.is_none() {
        println!("skipped: SPHEREFLOW_DATA is not set");
    }
    found
}

fn tum(root: &Path) -> Recording {
    let list = std::fs::read_to_string(root.join("depth.txt")).unwrap();
    let rows = list.lines().filter(|line| !line.starts_with('#'));
    let frames = rows.map(|line| {
        let (stamp, name) = line.split_once(' ').unwrap();
        (stamp.parse().unwrap(), root.join(name))
    });
    let lens = [
        0.262383, -0.953104, -0.005358, 0.002628, 1.163314, 0.0, 0.0, 0.0,
    ];
    let camera = match std::env::var("TUMCAM").as_deref() {
        Ok("pin") => {
            Camera::pinhole(517.306408, 516.469215, 318.643040, 255.313989, 640, 480).unwrap()
        }
        Ok("525") => Camera::pinhole(525.0, 525.0, 319.5, 239.5, 640, 480).unwrap(),
        _ => Camera::opencv(
            517.306408, 516.469215, 318.643040, 255.313989, lens, 640, 480,
        )
        .unwrap(),
    };
    Recording {
        camera,
        frames: frames.collect(),
        depth_scale: 5000.0,
        truth: sphereflow_io::trajectory::read_tum(&root.join("groundtruth.txt")).unwrap(),
    }
}

fn seven_scenes(root: &Path) -> Recording {
    let stamp = |i: usize| Stamp::from_ns(i as i64 * 1_000_000_000 / 30);
    let count = (0..)
        .take_while(|i| root.join(format!("frame-{i:06}.depth.png")).exists())
        .count();
    let pose = |i: usize| {
        let text = std::fs::read_to_string(root.join(format!("frame-{i:06}.pose.txt"))).unwrap();
        let numbers: Vec<f64> = text
            .split_whitespace()
            .map(|v| v.parse().unwrap())
            .collect();
        Pose::from_matrix(&nalgebra::Matrix4::from_row_slice(&numbers)).unwrap()
    };
    Recording {
        camera: Camera::pinhole(585.0, 585.0, 320.0, 240.0, 640, 480).unwrap(),
        frames: (0..count)
            .map(|i| (stamp(i), root.join(format!("frame-{i:06}.depth.png"))))
            .collect(),
        depth_scale: 1000.0,
        truth: Trajectory::from_vecs(
            (0..count).map(stamp).collect(),
            (0..count).map(pose).collect(),
        )
        .unwrap(),
    }
}

/// What a run is judged by.
#[derive(Debug)]
struct Figures {
    ate_m: f64,
    rpe_m: f64,
    rpe_rad: f64,
    frame_m: f64,
    frame_rad: f64,
    ms: f64,
    lost: usize,
    weak: usize,
    skipped: usize,
    frames: usize,
    min_score: f64,
    nees: f64,
}

fn run(recording: &Recording, config: Config) -> Figures {
    let mut odometry = DepthOdometry::new(&recording.camera, config).unwrap();
    let (mut estimated, mut true_poses, mut times) = (Vec::new(), Vec::new(), Vec::new());
    let (mut lost, mut weak, mut skipped, mut scores, mut nees) = (0, 0, 0, Vec::new(), Vec::new());
    let mut before: Option<(Stamp, Pose)> = None;
    for (index, (stamp, _)) in recording.frames.iter().enumerate() {
        let result = odometry.push(&recording.depth(index), *stamp).unwrap();
        match result.status.name() {
            "lost" => lost += 1,
            "weak" => weak += 1,
            "skipped" => skipped += 1,
            _ => (),
        }
        if result.status.name() == "lost" {
            println!("{index} {}", result.status);
        }
        times.push((result.timings.averaging_s + result.timings.estimation_s) * 1e3);
        let truth = recording.truth.interpolate(*stamp, 0.05);
        if let Some(e) = &result.estimate {
            scores.push(e.score);
            if let (Some(t), Some((s0, p0)), Some(c), Some(tw)) =
                (truth, before, e.covariance, e.twist)
            {
                let true_twist = sphereflow_odometry::twist_from_pose(
                    &(p0.inverse() * t),
                    stamp.seconds_since(s0),
                );
                let d = tw.vector() - true_twist.vector();
                nees.push(d.dot(&(c.try_inverse().unwrap() * d)));
            }
        }
        if result.status.name() != "skipped" {
            before = truth.map(|t| (*stamp, t));
        }
        if let Some(truth) = truth {
            estimated.push(result.world_from_camera);
            true_poses.push(truth);
        }
    }
    let (rpe_m, rpe_rad) = relative_errors(&estimated, &true_poses, 30);
    let rms =
        |values: &[f64]| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
    let (frame_m, frame_rad) = relative_errors(&estimated, &true_poses, 1);
    Figures {
        ate_m: trajectory_error(&estimated, &true_poses),
        rpe_m: rms(&rpe_m),
        rpe_rad: rms(&rpe_rad),
        frame_m: median(frame_m),
        frame_rad: median(frame_rad),
        ms: median(times),
        lost,
        weak,
        skipped,
        frames: recording.frames.len(),
        min_score: scores.iter().copied().fold(1.0, f64::min),
        nees: median(nees),
    }
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

fn tried() -> Vec<Config> {
    let d = Config::default();
    [0, 1, 2].map(|warps| Config { warps, ..d }).to_vec()
}

#[test]
fn tum_rpy_drift_is_bounded() {
    let Some(root) = data("tum-fr1-rpy-a") else {
        return;
    };
    let recording = tum(&root);
    for c in tried() {
        println!(
            "tum w{} b{} n{} share{} sw{} j{}  {:.4?}",
            c.warps,
            c.block,
            c.domains,
            c.domain_known_share,
            c.sweeps,
            c.max_jump,
            run(&recording, c)
        );
    }
}

#[test]
fn seven_scenes_kitchen_drift_is_bounded() {
    let Some(root) = data("sevenscenes-kitchen-a") else {
        return;
    };
    let recording = seven_scenes(&root);
    for c in tried() {
        println!(
            "seven w{} b{} n{} share{} sw{} j{}  {:.4?}",
            c.warps,
            c.block,
            c.domains,
            c.domain_known_share,
            c.sweeps,
            c.max_jump,
            run(&recording, c)
        );
    }
}
