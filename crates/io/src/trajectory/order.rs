//! What to do with stamps that do not increase: say so, or drop and count them.

use crate::rows::Row;
use crate::{Error, Result, Warnings};
use sphereflow_core::{Pose, Stamp, Trajectory};
use std::path::Path;

/// The rule for stamps that do not increase.
pub(crate) enum Order<'a> {
    /// An error that names the line.
    Strict,
    /// The row is left out and counted.
    Lenient(&'a mut Warnings),
}

/// Text of the lenient reader's warning for a stamp that occurs twice running.
const REPEATED: &str = "row with the stamp of the row before left out";
/// Text of the lenient reader's warning for a stamp that goes back.
const DECREASING: &str = "row with a stamp before the last one left out";

/// Puts rows together to a trajectory under an [`Order`].
pub(crate) struct Builder<'a> {
    order: Order<'a>,
    trajectory: Trajectory,
}

impl<'a> Builder<'a> {
    pub fn new(order: Order<'a>) -> Self {
        Self {
            order,
            trajectory: Trajectory::new(),
        }
    }

    pub fn push(&mut self, row: &Row<'_>, stamp: Stamp, pose: Pose) -> Result<()> {
        let last = self.trajectory.stamps().last().copied();
        match (last, &mut self.order) {
            (Some(last), Order::Strict) if stamp <= last => Err(row.error(
                format!("a stamp after {last} s (stamps must increase)"),
                format!("{stamp} s"),
            )),
            (Some(last), Order::Lenient(warnings)) if stamp <= last => {
                let text = if stamp == last { REPEATED } else { DECREASING };
                warnings.add(text, || {
                    format!("line {}: {stamp} s after {last} s", row.line)
                });
                Ok(())
            }
            _ => Ok(self.trajectory.push(stamp, pose)?),
        }
    }

    /// The trajectory; an error where the file at `path` had no rows.
    pub fn finish(self, path: &Path) -> Result<Trajectory> {
        if self.trajectory.is_empty() {
            return Err(Error::content(path, "at least one pose", "no poses"));
        }
        Ok(self.trajectory)
    }
}
