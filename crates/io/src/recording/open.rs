//! Opening a folder: guess what kind of recording it is, or say what was looked for.

use super::{Recording, euroc, seven_scenes, tum};
use crate::{CalibrationFile, Error, Result};
use std::path::Path;
use std::sync::Arc;

/// How to open a recording; the default takes everything from the recording.
#[derive(Clone, Debug, Default)]
pub struct OpenOptions {
    /// Instead of the calibration that would be found.
    pub calibration: Option<CalibrationFile>,
    /// Counts per metre, instead of the calibration's; a depth that then looks impossible is a
    /// warning, not an error.
    pub depth_scale: Option<f64>,
    /// Largest difference between the stamps of depth and colour, seconds; half the median frame
    /// interval where absent.
    pub sync_tolerance_s: Option<f64>,
}

/// Open a recording, guessing its kind from the files in `path`.
///
/// # Errors
/// [`Error::NotARecording`] with what was looked for; any error of the index, truth, inertial and
/// calibration files, each naming file and line; [`Error::Content`] where the first depth images
/// cannot be in the depth scale (median above 100 m or below 5 cm).
pub fn open_recording(path: &Path, options: &OpenOptions) -> Result<Recording> {
    check_options(options)?;
    std::fs::read_dir(path).map_err(Error::system(path, "read the folder"))?;
    let contents = if tum::is_here(path) {
        tum::open(path, options)?
    } else if seven_scenes::is_here(path)? {
        seven_scenes::open(path, options)?
    } else if let Some(files) = euroc::find(path) {
        euroc::open(path, &files)?
    } else {
        return Err(not_a_recording(path)?);
    };
    let recording = Recording(Arc::new(contents));
    recording.look_at_colour();
    Ok(recording)
}

fn check_options(options: &OpenOptions) -> Result<()> {
    if let Some(scale) = options.depth_scale {
        crate::images::check_scale(scale)?;
    }
    if let Some(tolerance) = options.sync_tolerance_s
        && !(tolerance.is_finite() && tolerance >= 0.0)
    {
        let expected = "seconds, not negative";
        return Err(sphereflow_core::Error::value("sync_tolerance_s", expected, tolerance).into());
    }
    Ok(())
}

/// How many names of a folder's content an error shows.
const SHOWN: usize = 6;

fn not_a_recording(path: &Path) -> Result<Error> {
    let entries = std::fs::read_dir(path).map_err(Error::system(path, "read the folder"))?;
    let mut names: Vec<String> = entries
        .flatten()
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    let cut_short = path
        .extension()
        .is_some_and(|extension| extension == "partial");
    let found = match names.len() {
        _ if cut_short => "a recording that was cut short (.partial): images, but no lists".into(),
        0 => "an empty folder".to_string(),
        n if n <= SHOWN => names.join(", "),
        n => format!("{}, ... ({n} entries)", names[..SHOWN].join(", ")),
    };
    Ok(Error::NotARecording {
        path: path.to_path_buf(),
        looked_for: "rgb.txt and depth.txt (TUM RGB-D), frame-000000.depth.png (7-Scenes), \
                     mav0/imu0/data.csv, imu0/data.csv or imu0.csv (EuRoC)"
            .into(),
        found,
    })
}
