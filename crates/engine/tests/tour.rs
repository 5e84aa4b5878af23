//! The main job on the simulated tour of a room.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

use sphereflow_core::{Plane, Pose, RgbdFrame, TrackStatus, Trajectory};
use sphereflow_engine::{Engine, EngineConfig, Kind, Update, World};
use sphereflow_sim::{DepthNoiseParameters, SimConfig, Simulator};
use sphereflow_sphere::{Calibration, Camera};

/// Seconds of the tour, at 30 Hz: a turn and a half of the table's corner, a few keyframes.
const DURATION_S: f64 = 2.5;
/// Rms distance of the positions once the first poses are the same, metres: the noise at 160x120 leaves
/// a quarter of it.
const DRIFT_M: f64 = 0.01;

/// The demo's tour, small, its depth with noise but not bent: a bent one alone makes 0.06 m.
fn tour() -> Simulator {
    let mut config = SimConfig::demo(3).unwrap();
    config.camera = Camera::pinhole(131.25, 131.25, 79.5, 59.5, 160, 120).unwrap();
    config.duration_s = DURATION_S;
    config.depth_noise = DepthNoiseParameters::Independent {
        sigma_inv_m: 2e-3,
        quantum_inv_m: 0.0,
    };
    Simulator::new(config).unwrap()
}

fn frames(simulator: &Simulator) -> Vec<RgbdFrame> {
    simulator.frames().map(|f| f.unwrap().frame).collect()
}

/// What is known of the simulated device.
fn calibration(simulator: &Simulator) -> Calibration {
    simulator
        .config()
        .calibration()
        .unwrap()
        .calibration()
        .unwrap()
}

fn run(calibration: Calibration, frames: &[RgbdFrame]) -> (Engine, Vec<Update>) {
    let mut engine = Engine::new(calibration, EngineConfig::default()).unwrap();
    let updates = frames
        .iter()
        .map(|frame| engine.push(frame.clone()).unwrap().unwrap())
        .collect();
    engine.finish().unwrap();
    (engine, updates)
}

/// Rms distance of the positions once the first poses are the same.
fn drift_m(found: &Trajectory, truth: &Trajectory) -> f64 {
    let start = found.poses()[0] * truth.interpolate(found.stamps()[0], 1.0).unwrap().inverse();
    let squares = found.iter().map(|(stamp, pose)| {
        let expected: Pose = start * truth.interpolate(stamp, 1.0).unwrap();
        (pose.translation - expected.translation).norm_squared()
    });
    (squares.sum::<f64>() / found.len() as f64).sqrt()
}

#[test]
fn engine_follows_the_tour_and_says_what_it_published() {
    let simulator = tour();
    let frames = frames(&simulator);
    let (engine, updates) = run(calibration(&simulator), &frames);
    assert_eq!(updates.len(), frames.len());
    assert_eq!(updates[0].status, TrackStatus::Started);
    let lost = updates.iter().filter(|u| !u.status.has_pose()).count();
    assert_eq!(lost, 0);
    let causal = engine.trajectory(Kind::Causal).unwrap();
    for (update, pose) in updates.iter().zip(causal.poses()) {
        assert_eq!(update.world_from_camera, *pose);
    }
    let truth = simulator.truth().unwrap();
    let last = engine.trajectory(Kind::Final).unwrap();
    let (published, corrected) = (drift_m(&causal, &truth), drift_m(&last, &truth));
    println!("drift: published {published:.4} m, final {corrected:.4} m");
    assert!(published < DRIFT_M && corrected < DRIFT_M);
    assert_eq!(engine.report().coverage(), 1.0);
    assert!(engine.cloud().len() > 1000, "{}", engine.cloud().len());
    assert!(engine.map().keyframes().len() > 2);
}

#[test]
fn engine_is_bit_identical_with_any_number_of_threads_and_after_a_reset() {
    let simulator = tour();
    let frames = frames(&simulator);
    let known = calibration(&simulator);
    let with_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let (engine, updates) = pool
            .build()
            .unwrap()
            .install(|| run(known.clone(), &frames));
        let poses: Vec<Pose> = updates.iter().map(|u| u.world_from_camera).collect();
        let covariances: Vec<_> = updates.iter().map(|u| u.covariance).collect();
        let points = engine.cloud().points();
        (
            poses,
            covariances,
            engine.trajectory(Kind::Final).unwrap(),
            points,
        )
    };
    let one = with_threads(1);
    assert!(one == with_threads(2) && one == with_threads(4));
    let (mut engine, _) = run(known, &frames);
    engine.reset().unwrap();
    for frame in &frames {
        engine.push(frame.clone()).unwrap();
    }
    engine.finish().unwrap();
    assert_eq!(engine.trajectory(Kind::Final).unwrap(), one.2);
}

#[test]
fn engine_covariance_grows_along_a_segment_and_stays_positive() {
    let simulator = tour();
    let (_, updates) = run(calibration(&simulator), &frames(&simulator));
    let size = |update: &Update| update.covariance.trace();
    assert!(size(&updates[1]) < size(updates.last().unwrap()));
    for update in &updates[1..] {
        assert!(update.covariance.cholesky().is_some(), "{update:?}");
    }
}

#[test]
fn engine_with_a_wrong_size_is_an_error_and_stays_as_it_was() {
    let simulator = tour();
    let frames = frames(&simulator);
    let mut engine = Engine::new(calibration(&simulator), EngineConfig::default()).unwrap();
    engine.push(frames[0].clone()).unwrap();
    let mut wrong = frames[1].clone();
    wrong.mask = Some(Plane::filled(10, 10, true));
    let error = engine.push(wrong).unwrap_err().to_string();
    assert!(
        error.starts_with("mask") && error.contains("160x120"),
        "{error}"
    );
    let update = engine.push(frames[1].clone()).unwrap().unwrap();
    assert!(update.status.has_pose(), "{}", update.status);
}

#[test]
fn engine_ignores_what_is_masked() {
    let simulator = tour();
    let frames = frames(&simulator);
    let mut engine = Engine::new(calibration(&simulator), EngineConfig::default()).unwrap();
    let mut blind = frames[0].clone();
    blind.mask = Some(Plane::filled(160, 120, true));
    let update = engine.push(blind).unwrap().unwrap();
    assert!(!update.status.has_pose(), "{}", update.status);
}

#[test]
fn engine_that_is_cancelled_keeps_whole_poses() {
    let simulator = tour();
    let frames = frames(&simulator);
    let mut engine = Engine::new(calibration(&simulator), EngineConfig::default()).unwrap();
    for frame in &frames {
        engine.push(frame.clone()).unwrap();
    }
    engine.cancel();
    let report = engine.finish().unwrap().unwrap();
    assert!(report.interrupted);
    let (causal, last) = (Kind::Causal, Kind::Final);
    let (causal, last) = (
        engine.trajectory(causal).unwrap(),
        engine.trajectory(last).unwrap(),
    );
    for (a, b) in causal.poses().iter().zip(last.poses()) {
        let (distance_m, angle_rad) = a.distance_and_angle(b);
        assert!(
            distance_m < 1e-12 && angle_rad < 1e-7,
            "{distance_m} {angle_rad}"
        );
    }
}

#[test]
fn engine_without_a_depth_camera_names_the_entry() {
    let error = Engine::new(Calibration::default(), EngineConfig::default()).unwrap_err();
    assert!(
        error.to_string().starts_with("calibration.depth"),
        "{error}"
    );
}

#[test]
fn engine_without_extrinsics_keeps_the_first_camera_and_says_why() {
    let simulator = tour();
    let mut known = calibration(&simulator);
    known.camera_from_imu = None;
    let mut engine = Engine::new(known, EngineConfig::default()).unwrap();
    let first = frames(&simulator).swap_remove(0);
    let update = engine.push(first).unwrap().unwrap();
    assert_eq!(update.world_from_camera, Pose::identity());
    assert!(
        matches!(&engine.report().world, World::FirstCamera { because } if because.contains("camera_from_imu"))
    );
}

#[test]
fn engine_never_claims_certainty_of_a_pose_that_it_predicts() {
    let simulator = tour();
    let frames = frames(&simulator);
    let blind = |frame: &RgbdFrame| RgbdFrame {
        stamp: frame.stamp,
        ..RgbdFrame::default()
    };
    let mut engine = Engine::new(calibration(&simulator), EngineConfig::default()).unwrap();
    let first = engine.push(blind(&frames[0])).unwrap().unwrap();
    assert!(first.covariance.iter().all(|v| v.is_nan()));
    for frame in &frames[1..40] {
        engine.push(frame.clone()).unwrap();
    }
    engine.finish().unwrap();
    let lost = engine.push(blind(&frames[42])).unwrap().unwrap();
    assert!(!lost.status.has_pose());
    assert!(lost.covariance.cholesky().is_some(), "{}", lost.covariance);
}
