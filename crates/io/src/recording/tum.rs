//! TUM RGB-D folders, and our own recordings, which are TUM folders with more in them.

use super::association;
use super::calibrate::{Fallback, calibrate};
use super::index::{self, Listed};
use super::{
    Calibrated, Contents, FrameFiles, OpenOptions, RecordingKind, SyncStatistics, samples,
    scale_check, sync,
};
use crate::calibration::{published, ros_default};
use crate::trajectory::{TrajectoryFormat, read_trajectory_lenient};
use crate::{Error, Result, Warnings};
use sphereflow_core::{ImuSample, Stamp, Trajectory};
use std::io::Read;
use std::path::Path;

/// True where one of the two lists is there: the other's absence is then worth its own error.
pub(super) fn is_here(path: &Path) -> bool {
    path.join("rgb.txt").is_file()
        || path.join("depth.txt").is_file()
        || association::find(path).is_some()
}

pub(super) fn open(path: &Path, options: &OpenOptions) -> Result<Contents> {
    let mut warnings = Warnings::default();
    let (depth, colour) = lists(path, &mut warnings)?;
    let stamps: Vec<Stamp> = depth.iter().map(|listed| listed.stamp).collect();
    let (files, sync) = pair(depth, &colour, &stamps, options, &mut warnings);
    let calibrated = calibrate(path, &files, options, &mut warnings, || Ok(fallback(path)))?;
    let insisted = options.depth_scale.is_some();
    scale_check::check(path, &files, &calibrated, insisted, &mut warnings)?;
    let mag_file = path.join("mag.csv");
    let mag = match mag_file.is_file() {
        true => samples::read_mag(&mag_file, &mut warnings)?,
        false => Vec::new(),
    };
    Ok(Contents {
        kind: RecordingKind::TumRgbd,
        path: path.to_path_buf(),
        stamps,
        files,
        colour_registered: true,
        truth: truth(path, &mut warnings)?,
        imu: imu(path, &mut warnings)?,
        mag,
        gravity_in_world: calibrated.calibration.gravity_in_world_m_s2,
        sync,
        notes: notes(&calibrated),
        calibrated: Some(calibrated),
        warnings,
        colour_warnings: std::sync::Mutex::default(),
    })
}

/// The depth and the colour images that the folder lists.
fn lists(path: &Path, warnings: &mut Warnings) -> Result<(Vec<Listed>, Vec<Listed>)> {
    if !path.join("depth.txt").is_file() {
        return match association::find(path) {
            Some(file) => association::read(&file, warnings),
            None => Err(Error::content(
                path,
                "depth.txt beside rgb.txt",
                "no such file",
            )),
        };
    }
    let depth = index::read(path, "depth.txt", warnings)?;
    if depth.is_empty() {
        let expected = "depth images listed in depth.txt";
        return Err(Error::content(path, expected, "none"));
    }
    if path.join("rgb.txt").is_file() {
        return Ok((depth, index::read(path, "rgb.txt", warnings)?));
    }
    warnings.add("no rgb.txt: frames have no colour", || "rgb.txt is missing");
    Ok((depth, Vec::new()))
}

/// Each depth image takes the nearest colour image.
fn pair(
    depth: Vec<Listed>,
    colour: &[Listed],
    stamps: &[Stamp],
    options: &OpenOptions,
    warnings: &mut Warnings,
) -> (Vec<FrameFiles>, Option<SyncStatistics>) {
    let tolerance_ns = match options.sync_tolerance_s {
        Some(seconds) => (seconds * 1e9).round() as u64,
        None => sync::half_median_interval_ns(stamps),
    };
    let colour_stamps: Vec<Stamp> = colour.iter().map(|listed| listed.stamp).collect();
    let pairs = sync::nearest(stamps, &colour_stamps, tolerance_ns);
    let mut used = vec![false; colour.len()];
    let mut files = Vec::with_capacity(depth.len());
    for (listed, pair) in depth.into_iter().zip(&pairs) {
        match pair {
            Some(index) => used[*index] = true,
            None if colour.is_empty() => {}
            None => warnings.add("depth image without colour within the tolerance", || {
                format!("{} s", listed.stamp)
            }),
        }
        files.push(FrameFiles {
            depth: listed.path,
            colour: pair.map(|index| colour[index].path.clone()),
        });
    }
    for (listed, _) in colour.iter().zip(&used).filter(|(_, used)| !**used) {
        warnings.add(
            "colour image without depth within the tolerance left out",
            || format!("{} s", listed.stamp),
        );
    }
    let statistics = sync::statistics(stamps, &colour_stamps, &pairs, tolerance_ns);
    (files, statistics)
}

fn truth(path: &Path, warnings: &mut Warnings) -> Result<Option<Trajectory>> {
    let file = path.join("groundtruth.txt");
    if !file.is_file() {
        return Ok(None);
    }
    let (trajectory, dropped) = read_trajectory_lenient(&file, Some(TrajectoryFormat::Tum))?;
    warnings.append("groundtruth.txt", dropped);
    Ok(Some(trajectory))
}

/// `imu.csv` of our own recordings, else TUM's accelerometer.
fn imu(path: &Path, warnings: &mut Warnings) -> Result<Vec<ImuSample>> {
    let (own, accelerometer) = (path.join("imu.csv"), path.join("accelerometer.txt"));
    if own.is_file() {
        samples::read_imu(&own, warnings)
    } else if accelerometer.is_file() {
        samples::read_accelerometer(&accelerometer, warnings)
    } else {
        Ok(Vec::new())
    }
}

fn notes(calibrated: &Calibrated) -> Vec<String> {
    let calibration = &calibrated.calibration;
    let mut notes = vec![
        "frames carry the stamps of their depth images".to_string(),
        "truth is world from the colour camera's optical frame".to_string(),
    ];
    if calibration.depth.model != "pinhole" {
        notes.push("depth is registered to the distorted colour image".into());
    }
    notes
}

/// The published calibration of the camera named in a list's header or in the folder's name, else
/// the ROS driver's default.
fn fallback(path: &Path) -> Fallback {
    let named = camera_named_in_headers(path).or_else(|| {
        let folder = std::fs::canonicalize(path).ok()?;
        let name = folder.file_name()?.to_string_lossy().into_owned();
        Some((freiburg_in(&name)?, "the folder's name".to_string()))
    });
    if let Some((number, place)) = named
        && let Some(calibration) = published(number)
    {
        let source = format!("published calibration of freiburg{number}, named in {place}");
        return Fallback {
            calibration,
            source,
            guessed: false,
        };
    }
    let source = "ROS default of an uncalibrated Kinect (525, 525, 319.5, 239.5): no \
                  calibration.toml, and no freiburg camera named";
    Fallback {
        calibration: ros_default(),
        source: source.into(),
        guessed: true,
    }
}

/// Enough for the comments at the head of a file.
const HEADER_BYTES: u64 = 512;

fn camera_named_in_headers(path: &Path) -> Option<(u8, String)> {
    let lists = [
        "rgb.txt",
        "depth.txt",
        "groundtruth.txt",
        "accelerometer.txt",
    ];
    lists.iter().find_map(|name| {
        let file = std::fs::File::open(path.join(name)).ok()?;
        let mut head = Vec::new();
        file.take(HEADER_BYTES).read_to_end(&mut head).ok()?;
        let text = String::from_utf8_lossy(&head);
        let comments = text.lines().filter(|line| line.starts_with('#'));
        let number = comments.filter_map(freiburg_in).next()?;
        Some((number, (*name).to_string()))
    })
}

fn freiburg_in(text: &str) -> Option<u8> {
    let (_, after) = text.split_once("freiburg")?;
    let digits: String = after.chars().take_while(char::is_ascii_digit).collect();
    digits.parse().ok()
}
