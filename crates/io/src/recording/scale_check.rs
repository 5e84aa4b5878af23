//! Does the depth scale make sense? The median depth of the first frames tells.

use super::{Calibrated, FrameFiles};
use crate::images::{depth_from_raw, file_is_low_byte_first, read_raw_depth};
use crate::rows::read_bytes;
use crate::{Error, Result, Warnings};
use std::path::Path;

/// Frames looked at.
const FRAMES: usize = 3;
/// No depth camera sees a median nearer than this, metres ...
const NEAREST_M: f64 = 0.05;
/// ... or farther than this.
const FARTHEST_M: f64 = 100.0;
/// Scales in use: float metres, centimetres, millimetres, TUM, tenths of millimetres.
const USUAL_SCALES: [f64; 5] = [1.0, 100.0, 1000.0, 5000.0, 10000.0];
/// Where the median depth of hand-held recordings lies, metres.
const USUAL_DEPTH_M: std::ops::Range<f64> = 0.4..8.0;

/// An error where the median depth of the first readable frames is impossible; a warning where the
/// caller insisted on the scale.
pub(super) fn check(
    folder: &Path,
    files: &[FrameFiles],
    known: &Calibrated,
    insisted: bool,
    warnings: &mut Warnings,
) -> Result<()> {
    let scale = known.calibration.depth_scale;
    let mut depths: Vec<f32> = Vec::new();
    // Corrupt images are reported when their frame is read.
    let readable = files
        .iter()
        .take(FRAMES)
        .filter_map(|f| read_raw_depth(&f.depth).ok());
    for raw in readable {
        let metres = depth_from_raw(&raw, scale)?.into_plane().into_vec();
        depths.extend(metres.into_iter().filter(|value| value.is_finite()));
    }
    if let Some(first) = files.first()
        && let Ok(bytes) = read_bytes(&first.depth)
        && file_is_low_byte_first(&bytes)
    {
        warnings.add(
            "depth is PGM with the low byte first: read so",
            || "the format puts the high byte first, in which neighbouring pixels would jump",
        );
    }
    if depths.is_empty() {
        warnings.add(
            "the first frames have no known depth",
            || "depth 0 or 65535 everywhere",
        );
        return Ok(());
    }
    let middle = depths.len() / 2;
    let median = f64::from(*depths.select_nth_unstable_by(middle, f32::total_cmp).1);
    if (NEAREST_M..=FARTHEST_M).contains(&median) {
        return Ok(());
    }
    let found = format!(
        "median depth {median:.3} m at depth_scale {scale}{}",
        hint(median * scale)
    );
    if insisted {
        warnings.add("the depth scale looks wrong", || found);
        return Ok(());
    }
    let expected = format!("a median depth of {NEAREST_M} to {FARTHEST_M} m in the first frames");
    Err(Error::content(folder, expected, found))
}

fn hint(median_counts: f64) -> String {
    let plausible: Vec<String> = USUAL_SCALES
        .iter()
        .filter(|&&scale| USUAL_DEPTH_M.contains(&(median_counts / scale)))
        .map(f64::to_string)
        .collect();
    match plausible.as_slice() {
        [] => String::new(),
        some => format!(": is depth_scale {}?", some.join(" or ")),
    }
}
