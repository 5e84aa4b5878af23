//! Poses to numbers in text and back, without loss.

use crate::Result;
use crate::rows::Row;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use sphereflow_core::{Error as CoreError, Pose, Stamp};
use std::fmt::Write;

/// A quaternion this near to unit norm (squared) was unit when it was written, and normalising it
/// again could change its last bits. A normalised one is within 1e-15; products of a few stay
/// within this.
const UNIT_TOLERANCE: f64 = 1e-14;

/// TUM files have at least nine decimals: evo and others print them so, and tables line up.
const DECIMALS: usize = 9;

/// A pose from numbers in a file; the quaternion is normalised only where that is needed.
pub(crate) fn pose_from_parts(
    translation: [f64; 3],
    quat_xyzw: [f64; 4],
) -> std::result::Result<Pose, CoreError> {
    let [x, y, z, w] = quat_xyzw;
    let quaternion = Quaternion::new(w, x, y, z);
    let unit = (quaternion.norm_squared() - 1.0).abs() <= UNIT_TOLERANCE;
    if unit && translation.iter().all(|v| v.is_finite()) {
        return Ok(Pose::new(
            UnitQuaternion::new_unchecked(quaternion),
            Vector3::from(translation),
        ));
    }
    Pose::from_parts(translation, quat_xyzw)
}

/// A pose from a row's numbers.
pub(super) fn pose_of(row: &Row<'_>, translation: [f64; 3], quat_xyzw: [f64; 4]) -> Result<Pose> {
    pose_from_parts(translation, quat_xyzw).map_err(|error| match error {
        CoreError::Value {
            argument,
            expected,
            found,
        } => row.error(format!("{argument}: {expected}"), found),
        other => other.into(),
    })
}

/// An error where a pose that is to be written is not finite.
pub(super) fn check_finite(stamp: Stamp, pose: &Pose) -> Result<()> {
    let finite = pose.translation.iter().all(|v| v.is_finite())
        && pose.quat_xyzw().iter().all(|v| v.is_finite());
    if finite {
        return Ok(());
    }
    Err(CoreError::value(
        "trajectory",
        "finite poses",
        format!(
            "at {stamp} s translation {:?}, quat_xyzw {:?}",
            pose.translation.as_slice(),
            pose.quat_xyzw()
        ),
    )
    .into())
}

/// Append `separator` and the number in plain decimal notation: at least nine decimals, and as many
/// more as it takes to read back the same `f64`.
pub(super) fn append_decimal(line: &mut String, separator: char, value: f64) {
    line.push(separator);
    let start = line.len();
    // Writing to a String cannot fail.
    let _ = write!(line, "{value}");
    let written = &line[start..];
    let decimals = match written.find('.') {
        Some(point) => written.len() - point - 1,
        None => {
            line.push('.');
            0
        }
    };
    line.extend(std::iter::repeat_n('0', DECIMALS.saturating_sub(decimals)));
}

/// Append `separator` and the shortest text that reads back the same `f64`.
pub(super) fn append_shortest(line: &mut String, separator: char, value: f64) {
    line.push(separator);
    // Writing to a String cannot fail. Debug notation uses exponents where they are shorter.
    let _ = write!(line, "{value:?}");
}
