//! Which calibration holds for a recording: the caller's, the folder's, a published one, a default.

use super::{Calibrated, FrameFiles, OpenOptions};
use crate::images::read_raw_depth;
use crate::{CalibrationFile, Error, Result, Warnings};
use sphereflow_sphere::DepthCorrector;
use std::path::Path;

/// Name of the calibration in a recording's folder.
pub(crate) const FILE: &str = "calibration.toml";

/// What holds where the recording says nothing.
pub(super) struct Fallback {
    pub calibration: CalibrationFile,
    /// In words.
    pub source: String,
    /// True where nothing but the folder's layout speaks for it.
    pub guessed: bool,
}

fn warn_of_guess(
    folder: &Path,
    calibration: &CalibrationFile,
    scale_given: bool,
    warnings: &mut Warnings,
) {
    let parameter = |name: &str| calibration.depth.parameters.get(name).copied();
    let [fx, fy, cx, cy] = ["fx", "fy", "cx", "cy"].map(|n| parameter(n).unwrap_or(f64::NAN));
    let other = other_calibration(folder);
    let other = other.map_or(String::new(), |name| {
        format!("; {name} is there, but only TOML is read")
    });
    warnings.add("the intrinsics are a guess", || {
        format!(
            "fx {fx}, fy {fy}, cx {cx}, cy {cy}: give the camera's in {FILE}, or a calibration \
             file{other}"
        )
    });
    if !scale_given {
        warnings.add("the depth scale is a guess", || {
            let scale = calibration.depth_scale;
            format!("{scale} counts per metre: give the camera's in {FILE}, or depth_scale")
        });
    }
}

/// A file of the folder that looks like a calibration in another format.
fn other_calibration(folder: &Path) -> Option<String> {
    let entries = std::fs::read_dir(folder).ok()?.flatten();
    let mut names: Vec<String> = entries
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .filter(|name| {
            let lower = name.to_ascii_lowercase();
            let speaks = ["calib", "camera", "intrinsic", "cam0", "camchain"];
            let format = [".yaml", ".yml", ".json", ".xml", ".txt", ".ini"];
            speaks.iter().any(|word| lower.contains(word))
                && format.iter().any(|end| lower.ends_with(end))
        })
        .collect();
    names.sort();
    names.into_iter().next()
}

/// The caller's calibration, else the folder's file, else `fallback` (with its source in words),
/// which must be of the images' size.
pub(super) fn calibrate(
    folder: &Path,
    files: &[FrameFiles],
    options: &OpenOptions,
    warnings: &mut Warnings,
    fallback: impl FnOnce() -> Result<Fallback>,
) -> Result<Calibrated> {
    let file = folder.join(FILE);
    let mut guessed = false;
    let (mut calibration, mut source) = if let Some(given) = &options.calibration {
        (given.clone(), "given by the caller".to_string())
    } else if file.is_file() {
        (
            CalibrationFile::read(&file)?,
            format!("{FILE} of the recording"),
        )
    } else {
        let found = fallback()?;
        guessed = found.guessed;
        (found.calibration, found.source)
    };
    check_image_size(folder, files, &calibration, &source)?;
    if let Some(scale) = options.depth_scale {
        calibration.depth_scale = scale;
        source.push_str(", depth_scale given by the caller");
    }
    if guessed {
        warn_of_guess(
            folder,
            &calibration,
            options.depth_scale.is_some(),
            warnings,
        );
    }
    let camera = calibration.camera()?;
    let correction = calibration.depth_field.filter(|c| !c.is_identity());
    Ok(Calibrated {
        corrector: correction
            .map(|correction| DepthCorrector::new(&camera, &correction))
            .transpose()?,
        camera,
        calibration,
        source,
    })
}

/// The calibration must be for images of the size that the first readable depth image has.
fn check_image_size(
    folder: &Path,
    files: &[FrameFiles],
    calibration: &CalibrationFile,
    source: &str,
) -> Result<()> {
    let mut sizes = files
        .iter()
        .filter_map(|f| read_raw_depth(&f.depth).ok().map(|raw| raw.size()));
    let known = (calibration.depth.width, calibration.depth.height);
    match sizes.next() {
        Some((width, height)) if (width, height) != known => Err(Error::content(
            folder,
            format!("a calibration ({FILE}) for its images of {width}x{height}"),
            format!("one for {}x{}: {source}", known.0, known.1),
        )),
        _ => Ok(()),
    }
}
