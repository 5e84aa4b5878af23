//! How unknowns are numbered, and the largest block of the normal matrix.

use crate::{Error, Result};
use nalgebra::SMatrix;

/// No block, no touch.
pub(crate) const NONE: u32 = u32::MAX;
/// Numbers of a motion's update: velocity, gyrometer bias, accelerometer bias.
pub(crate) const MOTION: usize = 9;
/// A block of the normal matrix, of which a pose takes the first six rows or columns.
pub(crate) type Block = SMatrix<f64, MOTION, MOTION>;

/// # Errors
/// Where there is no item `found` among so many.
pub(super) fn index(argument: &str, found: usize, count: usize) -> Result<()> {
    if found < count {
        return Ok(());
    }
    Err(Error::value(
        argument,
        format!("an index below {count}"),
        found,
    ))
}
