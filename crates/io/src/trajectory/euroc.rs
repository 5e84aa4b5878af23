//! EuRoC trajectories: integer nanoseconds, position, quaternion w x y z.

use super::order::{Builder, Order};
use super::pose_text::{append_shortest, check_finite, pose_of};
use crate::rows::{Row, header, read_text, rows};
use crate::times::Unit;
use crate::{Result, beside};
use sphereflow_core::{Pose, Stamp, Trajectory};
use std::path::Path;

const COLUMNS: &str = "ns, px, py, pz, qw, qx, qy, qz";
const HEADER: &str = "#timestamp [ns],p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z []\n";

/// Read the poses of a EuRoC state file (`state_groundtruth_estimate0/data.csv`): nanoseconds,
/// metres, quaternion **w x y z**; columns after the eighth (velocity, biases) are passed over.
/// In the data set the poses are `world_from_body`, the body being the IMU.
///
/// # Errors
/// As [`super::read_trajectory`].
pub fn read_euroc(path: &Path) -> Result<Trajectory> {
    read(path, Order::Strict)
}

pub(crate) fn read(path: &Path, order: Order<'_>) -> Result<Trajectory> {
    let text = read_text(path)?;
    let mut builder = Builder::new(order);
    let names = header(&text);
    // A header that names the unit is believed: our own files say it.
    let unit = match names.first() {
        Some(name) if name.contains("[ns]") => Unit::Nanoseconds,
        _ => builder.unit(path, &text, Unit::Nanoseconds)?,
    };
    let scalar_last = scalar_is_last(&names);
    for row in rows(path, &text) {
        let parsed = parse(&row, unit, scalar_last);
        builder.add(&row, parsed)?;
    }
    builder.finish(path)
}

/// True where the names of the columns put the quaternion's scalar last, against the format's habit.
fn scalar_is_last(names: &[&str]) -> bool {
    let is_scalar = |name: &str| {
        let word: String = name.chars().filter(|c| c.is_ascii_alphabetic()).collect();
        let word = word.to_ascii_lowercase();
        word.starts_with('q') && word.trim_end_matches("ns").ends_with('w')
    };
    names.len() >= 8 && names.iter().position(|name| is_scalar(name)) == Some(7)
}

fn parse(row: &Row<'_>, unit: Unit, scalar_last: bool) -> Result<(Stamp, Pose)> {
    row.expect_at_least(8, COLUMNS)?;
    let mut quat: [f64; 4] = row.numbers(4)?;
    if !scalar_last {
        quat.rotate_left(1);
    }
    let pose = pose_of(row, row.numbers(1)?, quat)?;
    Ok((row.stamp(0, unit)?, pose))
}

/// Write the eight columns of a EuRoC state file, without velocity and biases. Every number has
/// the fewest digits that read back the same `f64`.
///
/// # Errors
/// As [`super::write_trajectory`].
pub fn write_euroc(path: &Path, trajectory: &Trajectory) -> Result<()> {
    let mut text = String::with_capacity(160 * (trajectory.len() + 1));
    text.push_str(HEADER);
    for (stamp, pose) in trajectory.iter() {
        check_finite(stamp, pose)?;
        text.push_str(&stamp.ns().to_string());
        let [x, y, z, w] = pose.quat_xyzw();
        for value in pose.translation.iter().chain(&[w, x, y, z]) {
            append_shortest(&mut text, ',', *value);
        }
        text.push('\n');
    }
    beside::write_bytes(path, text.as_bytes())
}
