//! 7-Scenes folders: numbered frames without time, poses by KinectFusion.

use super::calibrate::{Fallback, calibrate};
use super::{Contents, FrameFiles, OpenOptions, RecordingKind, scale_check};
use crate::rows::{read_text, rows};
use crate::{CalibrationFile, Error, Result, Warnings};
use nalgebra::{Matrix4, Vector3};
use rayon::prelude::*;
use sphereflow_core::{Pose, Stamp, Trajectory};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The nominal rate of the Kinect, frames per second.
const NOMINAL_HZ: i64 = 30;
const DEPTH_SCALE: f64 = 1000.0;
const STANDARD_GRAVITY_M_S2: f64 = 9.80665;
/// The depth camera's intrinsics as the authors give them.
const INTRINSICS: [(&str, f64); 4] = [("fx", 585.0), ("fy", 585.0), ("cx", 320.0), ("cy", 240.0)];

#[derive(Default)]
struct Numbered {
    depth: Option<PathBuf>,
    colour: Option<PathBuf>,
    pose: Option<PathBuf>,
}

pub(super) fn is_here(path: &Path) -> Result<bool> {
    Ok(scan(path)?
        .values()
        .any(|files| files.depth.is_some() || files.colour.is_some()))
}

pub(super) fn open(path: &Path, options: &OpenOptions) -> Result<Contents> {
    let mut warnings = Warnings::default();
    let (mut stamps, mut files, mut poses) = (Vec::new(), Vec::new(), Vec::new());
    let mut expected_number = None;
    for (number, found) in scan(path)? {
        if expected_number.is_some_and(|expected| expected != number) {
            warnings.add("gap in the frame numbers", || {
                format!("before frame {number}")
            });
        }
        expected_number = Some(number + 1);
        let Some(depth) = found.depth else {
            warnings.add("colour image without depth left out", || {
                format!("frame {number}")
            });
            continue;
        };
        if found.colour.is_none() {
            warnings.add("depth image without colour", || format!("frame {number}"));
        }
        stamps.push(Stamp::from_ns(number * 1_000_000_000 / NOMINAL_HZ));
        poses.push(found.pose);
        files.push(FrameFiles {
            depth,
            colour: found.colour,
        });
    }
    if files.is_empty() {
        return Err(Error::content(
            path,
            "depth images frame-NNNNNN.depth.png",
            "none",
        ));
    }
    let calibrated = calibrate(path, &files, options, &mut warnings, || fallback(path))?;
    let insisted = options.depth_scale.is_some();
    scale_check::check(path, &files, &calibrated, insisted, &mut warnings)?;
    Ok(Contents {
        kind: RecordingKind::SevenScenes,
        path: path.to_path_buf(),
        truth: truth(&stamps, &poses, &mut warnings)?,
        stamps,
        files,
        calibrated: Some(calibrated),
        colour_registered: false,
        imu: Vec::new(),
        mag: Vec::new(),
        gravity_in_world: gravity(path)?,
        sync: None,
        warnings,
        colour_warnings: std::sync::Mutex::default(),
        notes: vec![
            format!("no stamps recorded: nominal {NOMINAL_HZ} Hz from the frame number"),
            "colour is not registered to depth (about 25 mm baseline)".into(),
            "truth is world from depth camera, by KinectFusion, good to 1-2 cm".into(),
        ],
    })
}

/// What `info.txt` of the recorder says, else the intrinsics that are published for the data set.
fn fallback(path: &Path) -> Result<Fallback> {
    let info = path.join("info.txt");
    if info.is_file()
        && let Some(calibration) = recorder_calibration(&read_text(&info)?)
    {
        return Ok(Fallback {
            calibration,
            source: "info.txt of the recorder".into(),
            guessed: false,
        });
    }
    Ok(Fallback {
        calibration: CalibrationFile::of_model("pinhole", &INTRINSICS, (640, 480), DEPTH_SCALE),
        source: "7-Scenes depth camera as published (585, 585, 320, 240)".into(),
        guessed: true,
    })
}

/// The depth camera of an `info.txt` (`m_name = value`), as recorders of this layout write it;
/// `None` where an entry is missing or no number.
fn recorder_calibration(text: &str) -> Option<CalibrationFile> {
    let entry = |name: &str| {
        let mut pairs = text.lines().filter_map(|line| line.split_once('='));
        pairs.find(|(key, _)| key.trim() == name)
    };
    let number = |name: &str| entry(name)?.1.trim().parse::<f64>().ok();
    let (width, height) = (number("m_depthWidth")?, number("m_depthHeight")?);
    let (_, matrix) = entry("m_calibrationDepthIntrinsic")?;
    let matrix: Vec<f64> = matrix
        .split_whitespace()
        .filter_map(|field| field.parse().ok())
        .collect();
    let &[fx, _, cx, _, _, fy, cy, ..] = matrix.as_slice() else {
        return None;
    };
    let named = [("fx", fx), ("fy", fy), ("cx", cx), ("cy", cy)];
    let scale = number("m_depthShift")?;
    let size = (width as usize, height as usize);
    Some(CalibrationFile::of_model("pinhole", &named, size, scale))
}

/// The files of each frame number.
fn scan(path: &Path) -> Result<BTreeMap<i64, Numbered>> {
    let mut frames: BTreeMap<i64, Numbered> = BTreeMap::new();
    for entry in std::fs::read_dir(path).map_err(Error::system(path, "read the folder"))? {
        let file = entry
            .map_err(Error::system(path, "read the folder"))?
            .path();
        let Some((number, kind)) = file.file_name().and_then(|n| n.to_str()).and_then(parts) else {
            continue;
        };
        let frame = frames.entry(number).or_default();
        match kind {
            "depth.png" => frame.depth = Some(file),
            "color.png" | "color.jpg" => frame.colour = Some(file),
            "pose.txt" => frame.pose = Some(file),
            _ => {}
        }
    }
    Ok(frames)
}

/// `frame-000012.depth.png` is frame 12, `depth.png`.
fn parts(name: &str) -> Option<(i64, &str)> {
    let (digits, kind) = name.strip_prefix("frame-")?.split_once('.')?;
    let plain = digits.len() <= 9 && digits.bytes().all(|byte| byte.is_ascii_digit());
    Some((digits.parse().ok().filter(|_| plain)?, kind))
}

/// The poses that are there; a file that is no rigid transform is left out and counted (the
/// authors write such files where their tracking was lost).
fn truth(
    stamps: &[Stamp],
    files: &[Option<PathBuf>],
    warnings: &mut Warnings,
) -> Result<Option<Trajectory>> {
    let read: Vec<Option<Result<Pose>>> = files
        .par_iter()
        .map(|file| file.as_deref().map(read_pose))
        .collect();
    let mut trajectory = Trajectory::new();
    for (&stamp, pose) in stamps.iter().zip(read) {
        match pose {
            Some(Ok(pose)) => trajectory.push(stamp, pose)?,
            Some(Err(error)) => {
                warnings.add("pose file left out", || error.to_string());
            }
            None => warnings.add("frame without pose file", || format!("{stamp} s")),
        }
    }
    Ok((!trajectory.is_empty()).then_some(trajectory))
}

fn read_pose(path: &Path) -> Result<Pose> {
    let text = read_text(path)?;
    let mut values = Vec::with_capacity(16);
    for row in rows(path, &text) {
        row.expect_columns(4, "a row of a 4x4 matrix")?;
        values.extend(row.numbers::<4>(0)?);
    }
    if values.len() != 16 {
        let found = format!("{} rows", values.len() / 4);
        return Err(Error::content(path, "4 rows of a 4x4 matrix", found));
    }
    Pose::from_matrix(&Matrix4::from_row_slice(&values))
        .map_err(|_| Error::content(path, "a 4x4 rigid transform", format!("{values:?}")))
}

/// `gravity-direction.txt`, where it is there: three numbers, pointing down in the world.
fn gravity(folder: &Path) -> Result<Option<Vector3<f64>>> {
    let path = folder.join("gravity-direction.txt");
    if !path.is_file() {
        return Ok(None);
    }
    let text = read_text(&path)?;
    let mut values = Vec::new();
    for row in rows(&path, &text) {
        for column in 0..row.fields.len() {
            values.push(row.number(column)?);
        }
    }
    let direction = match values.as_slice() {
        &[x, y, z] => Vector3::new(x, y, z).try_normalize(1e-6),
        _ => None,
    };
    match direction {
        Some(down) => Ok(Some(down * STANDARD_GRAVITY_M_S2)),
        None => Err(Error::content(
            &path,
            "three numbers, not all zero",
            format!("{values:?}"),
        )),
    }
}
