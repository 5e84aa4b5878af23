//! EuRoC folders: inertial samples and truth; their stereo images have no depth and are passed over.

use super::{Contents, RecordingKind, samples};
use crate::trajectory::{TrajectoryFormat, read_trajectory_lenient};
use crate::{Error, Result, Warnings};
use nalgebra::Vector3;
use std::path::{Path, PathBuf};

const STANDARD_GRAVITY_M_S2: f64 = 9.80665;

/// The files of a EuRoC recording.
pub(super) struct Files {
    imu: PathBuf,
    truth: PathBuf,
}

/// The inertial file and where its truth would be: the ASL tree from above `mav0` or within it, or
/// two flat files.
pub(super) fn find(path: &Path) -> Option<Files> {
    let truth = "state_groundtruth_estimate0/data.csv";
    let layouts = [
        (
            path.join("mav0/imu0/data.csv"),
            path.join("mav0").join(truth),
        ),
        (path.join("imu0/data.csv"), path.join(truth)),
        (path.join("imu0.csv"), path.join("state_groundtruth.csv")),
    ];
    let here = layouts.into_iter().find(|(imu, _)| imu.is_file());
    here.map(|(imu, truth)| Files { imu, truth })
}

pub(super) fn open(path: &Path, files: &Files) -> Result<Contents> {
    let mut warnings = Warnings::default();
    let imu = samples::read_imu(&files.imu, &mut warnings)?;
    if imu.is_empty() {
        return Err(Error::content(&files.imu, "inertial samples", "none"));
    }
    let truth = if files.truth.is_file() {
        let format = Some(TrajectoryFormat::Euroc);
        let (trajectory, dropped) = read_trajectory_lenient(&files.truth, format)?;
        warnings.append("truth", dropped);
        Some(trajectory)
    } else {
        None
    };
    Ok(Contents {
        kind: RecordingKind::EurocImu,
        path: path.to_path_buf(),
        stamps: Vec::new(),
        files: Vec::new(),
        calibrated: None,
        colour_registered: false,
        truth,
        imu,
        mag: Vec::new(),
        // The world of the data set's truth has z up.
        gravity_in_world: Some(Vector3::new(0.0, 0.0, -STANDARD_GRAVITY_M_S2)),
        sync: None,
        warnings,
        colour_warnings: std::sync::Mutex::default(),
        notes: vec![
            "inertial samples and truth only: the stereo images have no depth".into(),
            "truth is world from body; the body is the IMU; the world's z is up".into(),
        ],
    })
}
