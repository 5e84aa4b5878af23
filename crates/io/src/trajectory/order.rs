//! What to do with stamps that do not increase: say so, or drop and count them.

use crate::rows::Row;
use crate::times::{self, Unit};
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

/// Text of the lenient reader's warning for a row whose pose is NaN.
const UNKNOWN: &str = "row without a pose (NaN) left out";
/// Text of the lenient reader's warning for a row that cannot be read.
const UNREADABLE: &str = "row that cannot be read left out";
/// Of the rows of a file, the largest share that may be unreadable: with more it is no trajectory.
const MOST_UNREADABLE: f64 = 0.2;

/// Text of the lenient reader's warning for a stamp that occurs twice running.
const REPEATED: &str = "row with the stamp of the row before left out";
/// Text of the lenient reader's warning for a stamp that goes back.
const DECREASING: &str = "row with a stamp before the last one left out";

/// Puts rows together to a trajectory under an [`Order`].
pub(crate) struct Builder<'a> {
    order: Order<'a>,
    trajectory: Trajectory,
    unreadable: Vec<Error>,
}

impl<'a> Builder<'a> {
    pub fn new(order: Order<'a>) -> Self {
        Self {
            order,
            trajectory: Trajectory::new(),
            unreadable: Vec::new(),
        }
    }

    /// The unit of the times in the first column; see [`times`].
    pub fn unit(&mut self, path: &Path, text: &str, usual: Unit) -> Result<Unit> {
        match &mut self.order {
            Order::Strict => times::check_unit(path, text, usual).map(|()| usual),
            Order::Lenient(warnings) => Ok(times::unit(path, text, 0, usual, warnings)),
        }
    }

    /// One row, whose pose may be unknown or unreadable.
    pub fn add(&mut self, row: &Row<'_>, parsed: Result<(Stamp, Pose)>) -> Result<()> {
        match (parsed, &mut self.order) {
            (Ok((stamp, pose)), _) => self.push(row, stamp, pose),
            (Err(error), Order::Strict) => Err(error),
            (Err(_), Order::Lenient(warnings)) if row.has_nan(1) => {
                warnings.add(UNKNOWN, || format!("line {}", row.line));
                Ok(())
            }
            (Err(error), Order::Lenient(warnings)) => {
                warnings.add(UNREADABLE, || error.to_string());
                self.unreadable.push(error);
                Ok(())
            }
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
        let (good, bad) = (self.trajectory.len(), self.unreadable.len());
        let too_many = bad as f64 > MOST_UNREADABLE * (good + bad) as f64;
        if let Some(first) = self.unreadable.into_iter().next()
            && too_many
        {
            return Err(first);
        }
        if self.trajectory.is_empty() {
            return Err(Error::content(path, "at least one pose", "no poses"));
        }
        Ok(self.trajectory)
    }
}
