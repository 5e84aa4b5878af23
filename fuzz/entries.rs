//! One entry a decoder: bytes in, nothing may panic, hang or use memory that the bytes do not ask for.
//!
//! The fuzz targets call these, and so do plain tests with a fixed budget.

use sphereflow_io::images::{read_colour, read_raw_depth};
use sphereflow_io::ply::read_ply;
use sphereflow_io::problems::{read_bundle, read_g2o};
use sphereflow_io::trajectory::{TrajectoryFormat, read_trajectory_lenient};
use sphereflow_io::{CalibrationFile, OpenOptions, open_recording};
use std::path::Path;

/// A decoder under its name.
pub type Entry = (&'static str, fn(&Path, &[u8]));

/// All of them; each gets a folder to write into.
pub const ENTRIES: [Entry; 11] = [
    ("tum_lists", tum_lists),
    ("tum", |folder, bytes| {
        trajectory(folder, bytes, TrajectoryFormat::Tum)
    }),
    ("kitti", |folder, bytes| {
        trajectory(folder, bytes, TrajectoryFormat::Kitti)
    }),
    ("euroc", |folder, bytes| {
        trajectory(folder, bytes, TrajectoryFormat::Euroc)
    }),
    ("imu_csv", imu_csv),
    ("g2o", |folder, bytes| {
        let _ = read_g2o(&written(folder, "a.g2o", bytes));
    }),
    // BAL, Bundler and libmv: the content decides.
    ("bundle", |folder, bytes| {
        let _ = read_bundle(&written(folder, "a.txt", bytes));
    }),
    ("ply", |folder, bytes| {
        let _ = read_ply(&written(folder, "a.ply", bytes));
    }),
    ("calibration", |folder, bytes| {
        let _ = CalibrationFile::read(&written(folder, "a.toml", bytes));
    }),
    ("depth_image", |folder, bytes| {
        let _ = read_raw_depth(&written(folder, "a.png", bytes));
    }),
    ("colour_image", |folder, bytes| {
        let _ = read_colour(&written(folder, "a.png", bytes));
    }),
];

/// Run the entry of this name.
pub fn run(name: &str, folder: &Path, bytes: &[u8]) {
    let entry = ENTRIES.iter().find(|(known, _)| *known == name);
    if let Some((_, decode)) = entry {
        decode(folder, bytes);
    }
}

fn written(folder: &Path, name: &str, bytes: &[u8]) -> std::path::PathBuf {
    let path = folder.join(name);
    // Where nothing can be written, the decoder reports a file that is not there.
    let _ = std::fs::write(&path, bytes);
    path
}

fn trajectory(folder: &Path, bytes: &[u8], format: TrajectoryFormat) {
    let _ = read_trajectory_lenient(&written(folder, "a.txt", bytes), Some(format));
}

fn tum_lists(folder: &Path, bytes: &[u8]) {
    written(folder, "depth.txt", bytes);
    let _ = open_recording(folder, &OpenOptions::default());
}

fn imu_csv(folder: &Path, bytes: &[u8]) {
    written(folder, "imu0.csv", bytes);
    let _ = std::fs::remove_file(folder.join("depth.txt"));
    let _ = open_recording(folder, &OpenOptions::default());
}
