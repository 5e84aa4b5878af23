//! Trajectory files: TUM, KITTI and EuRoC, read and written without loss.
//!
//! | format | row | time | quaternion |
//! | --- | --- | --- | --- |
//! | TUM | `t tx ty tz qx qy qz qw` | decimal seconds, 9 decimals | x y z w |
//! | KITTI | 12 numbers, row-major 3x4 | none, or a second file | matrix |
//! | EuRoC | `ns,px,py,pz,qw,qx,qy,qz,...` | integer nanoseconds | w x y z |
//!
//! Numbers are written with the fewest digits that read back as the same `f64`, so a TUM or EuRoC
//! file gives back every pose bit for bit; see [`write_kitti`] for what holds for matrices.

mod euroc;
mod format;
mod kitti;
mod order;
mod pose_text;
mod tum;

pub use euroc::{read_euroc, write_euroc};
pub use format::{TrajectoryFormat, guess_format};
pub use kitti::{read_kitti, write_kitti, write_kitti_times};
pub(crate) use pose_text::pose_from_parts;
pub use tum::{read_tum, write_tum};

use crate::{Result, Warnings};
use order::Order;
use sphereflow_core::Trajectory;
use std::path::Path;

/// Read a trajectory; without `format` the file's content decides ([`guess_format`]).
///
/// KITTI files have no time: their stamps are the row's index in **seconds**; use [`read_kitti`]
/// to give a file of times.
///
/// # Errors
/// [`crate::Error`] with path, line, what was expected and what was found: a wrong number of
/// columns, a number that is not finite, a quaternion whose norm is not near 1, stamps that do not
/// increase, no poses at all.
pub fn read_trajectory(path: &Path, format: Option<TrajectoryFormat>) -> Result<Trajectory> {
    read(path, format, Order::Strict)
}

/// [`read_trajectory`], except that rows whose stamp repeats or precedes the row before are left
/// out, and counted in the warnings.
///
/// # Errors
/// As [`read_trajectory`], but for the order of the stamps.
pub fn read_trajectory_lenient(
    path: &Path,
    format: Option<TrajectoryFormat>,
) -> Result<(Trajectory, Warnings)> {
    let mut warnings = Warnings::default();
    let trajectory = read(path, format, Order::Lenient(&mut warnings))?;
    Ok((trajectory, warnings))
}

fn read(path: &Path, format: Option<TrajectoryFormat>, order: Order<'_>) -> Result<Trajectory> {
    let format = match format {
        Some(format) => format,
        None => guess_format(path)?,
    };
    match format {
        TrajectoryFormat::Tum => tum::read(path, order),
        TrajectoryFormat::Kitti => kitti::read(path, None, order),
        TrajectoryFormat::Euroc => euroc::read(path, order),
    }
}

/// Write a trajectory; the file gets its name only when it is complete.
///
/// # Errors
/// [`crate::Error::System`] where the file cannot be written, [`crate::Error::Core`] where a pose
/// is not finite.
pub fn write_trajectory(
    path: &Path,
    trajectory: &Trajectory,
    format: TrajectoryFormat,
) -> Result<()> {
    match format {
        TrajectoryFormat::Tum => write_tum(path, trajectory, ""),
        TrajectoryFormat::Kitti => write_kitti(path, trajectory),
        TrajectoryFormat::Euroc => write_euroc(path, trajectory),
    }
}
