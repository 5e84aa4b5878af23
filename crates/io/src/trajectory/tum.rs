//! TUM trajectories: `t tx ty tz qx qy qz qw`.

use super::order::{Builder, Order};
use super::pose_text::{append_decimal, check_finite, pose_of};
use crate::rows::{Row, read_text, rows};
use crate::times::Unit;
use crate::{Result, beside};
use sphereflow_core::{Pose, Stamp, Trajectory};
use std::path::Path;

const COLUMNS: &str = "t tx ty tz qx qy qz qw";

/// Read a TUM trajectory: seconds, metres, quaternion x y z w; `#` starts a comment, columns are
/// separated by blanks or commas. Stamps are read exactly, without passing a float.
///
/// # Errors
/// As [`super::read_trajectory`].
pub fn read_tum(path: &Path) -> Result<Trajectory> {
    read(path, Order::Strict)
}

pub(crate) fn read(path: &Path, order: Order<'_>) -> Result<Trajectory> {
    let text = read_text(path)?;
    let mut builder = Builder::new(order);
    let unit = builder.unit(path, &text, Unit::Seconds)?;
    for row in rows(path, &text) {
        let parsed = parse(&row, unit);
        builder.add(&row, parsed)?;
    }
    builder.finish(path)
}

fn parse(row: &Row<'_>, unit: Unit) -> Result<(Stamp, Pose)> {
    if row.fields.len() == 4 {
        return Err(row.error(
            format!("8 columns ({COLUMNS})"),
            "4 columns: positions without orientation are no poses",
        ));
    }
    row.expect_columns(8, COLUMNS)?;
    let pose = pose_of(row, row.numbers(1)?, row.numbers(4)?)?;
    Ok((row.stamp(0, unit)?, pose))
}

/// Write a TUM trajectory: nine decimals of time from the integer nanoseconds; every other number
/// in plain decimal notation with nine decimals, or more where the `f64` needs more to read back
/// bit for bit. `comment` (which frames, which clock, ...) becomes `#` lines at the head.
///
/// # Errors
/// As [`super::write_trajectory`].
pub fn write_tum(path: &Path, trajectory: &Trajectory, comment: &str) -> Result<()> {
    let mut text = String::with_capacity(160 * (trajectory.len() + 1));
    for line in comment.lines() {
        text.push_str(&format!("# {line}\n"));
    }
    text.push_str(&format!("# {COLUMNS}\n"));
    for (stamp, pose) in trajectory.iter() {
        check_finite(stamp, pose)?;
        text.push_str(&stamp.to_string());
        for value in pose.translation.iter().chain(&pose.quat_xyzw()) {
            append_decimal(&mut text, ' ', *value);
        }
        text.push('\n');
    }
    beside::write_bytes(path, text.as_bytes())
}
