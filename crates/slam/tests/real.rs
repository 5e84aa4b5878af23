//! Real recordings: drift after keyframes were compared with each other.
//!
//! They run where `SPHEREFLOW_DATA` names the folder of the recordings, and print their figures:
//! `cargo test -p sphereflow-slam --release --test real -- --nocapture --test-threads 1`.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

#[path = "../../odometry/tests/drift/mod.rs"]
mod drift;

use drift::{Figures, open, run};
use sphereflow_alignment::Aligner;
use sphereflow_odometry::OdometryConfig;
use sphereflow_slam::{GraphConfig, Map};
use sphereflow_solver::StopFlag;

/// Figures of a recording's run with the poses after comparing its keyframes.
fn refined(name: &str, folder: &str, config: OdometryConfig) -> Option<Figures> {
    let recording = open(folder)?;
    let config = OdometryConfig {
        emit_keyframes: true,
        ..config
    };
    let mut measured = run(&recording, config);
    let mut map = Map::default();
    for result in &mut measured.results {
        for event in result.keyframes.drain(..) {
            map.insert(event);
        }
        map.hang(result);
    }
    let mut aligner = Aligner::new(recording.camera().unwrap(), config.alignment).unwrap();
    let (graph, stop) = (GraphConfig::default(), StopFlag::new());
    let report = map
        .refine(&mut aligner, &graph, &config.keyframes, &stop, |_, _| {})
        .unwrap();
    println!("{report:?}");
    assert!(report.converged, "{report:?}");
    let corrected = map.trajectory().unwrap();
    for result in &mut measured.results {
        if let Some(pose) = corrected.interpolate(result.stamp, 0.05) {
            result.world_from_camera = pose;
        }
    }
    Some(measured.figures(name))
}

#[test]
fn tum_rpy_drift_after_the_graph_is_bounded() {
    let config = OdometryConfig {
        readout_s: 0.03,
        ..OdometryConfig::default()
    };
    let name = "tum fr1_rpy, rolling shutter, pose graph";
    if let Some(figures) = refined(name, "tum-fr1-rpy-a", config) {
        assert!(figures.ate_m < 0.022, "{}", figures.ate_m);
    }
}

#[test]
fn seven_scenes_kitchen_drift_after_the_graph_is_bounded() {
    let config = OdometryConfig::default();
    let figures = refined("kitchen, pose graph", "sevenscenes-kitchen-a", config);
    if let Some(figures) = figures {
        assert!(figures.ate_m < 0.04, "{}", figures.ate_m);
    }
}
