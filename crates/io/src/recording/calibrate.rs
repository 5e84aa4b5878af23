//! Which calibration holds for a recording: the caller's, the folder's, a published one, a default.

use super::{Calibrated, FrameFiles, OpenOptions};
use crate::images::read_raw_depth;
use crate::{CalibrationFile, Error, Result};
use sphereflow_sphere::DepthCorrector;
use std::path::Path;

/// Name of the calibration in a recording's folder.
pub(crate) const FILE: &str = "calibration.toml";

/// The caller's calibration, else the folder's file, else `fallback` (with its source in words),
/// which must be of the images' size.
pub(super) fn calibrate(
    folder: &Path,
    files: &[FrameFiles],
    options: &OpenOptions,
    fallback: impl FnOnce() -> Result<(CalibrationFile, String)>,
) -> Result<Calibrated> {
    let file = folder.join(FILE);
    let (mut calibration, mut source) = if let Some(given) = &options.calibration {
        (given.clone(), "given by the caller".to_string())
    } else if file.is_file() {
        (
            CalibrationFile::read(&file)?,
            format!("{FILE} of the recording"),
        )
    } else {
        fallback()?
    };
    check_image_size(folder, files, &calibration, &source)?;
    if let Some(scale) = options.depth_scale {
        calibration.depth_scale = scale;
        source.push_str(", depth_scale given by the caller");
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
