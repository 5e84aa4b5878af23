//! EuRoC trajectories: integer nanoseconds, position, quaternion w x y z.

use super::order::{Builder, Order};
use super::pose_text::{append_shortest, check_finite, pose_of};
use crate::rows::{read_text, rows};
use crate::{Result, beside};
use sphereflow_core::Trajectory;
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
    for row in rows(path, &text) {
        row.expect_at_least(8, COLUMNS)?;
        let [w, x, y, z] = row.numbers(4)?;
        let pose = pose_of(&row, row.numbers(1)?, [x, y, z, w])?;
        builder.push(&row, row.stamp_nanoseconds(0)?, pose)?;
    }
    builder.finish(path)
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
