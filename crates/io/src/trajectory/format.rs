//! Which trajectory format a file is in.

use crate::rows::{read_text, rows};
use crate::{Error, Result};
use std::fmt;
use std::path::Path;
use std::str::FromStr;

/// Integer stamps with at least this many digits are nanoseconds: 10^15 ns are 11.6 days, and
/// 10^15 s have never been seen.
const NANOSECOND_DIGITS: usize = 16;

/// The formats of trajectory files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrajectoryFormat {
    /// `t tx ty tz qx qy qz qw`, time in seconds.
    Tum,
    /// Twelve numbers of a row-major 3x4 matrix, no time.
    Kitti,
    /// `ns,px,py,pz,qw,qx,qy,qz,...`, time in nanoseconds.
    Euroc,
}

impl fmt::Display for TrajectoryFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Tum => "tum",
            Self::Kitti => "kitti",
            Self::Euroc => "euroc",
        })
    }
}

impl FromStr for TrajectoryFormat {
    type Err = Error;

    /// `tum`, `kitti` or `euroc`.
    fn from_str(name: &str) -> Result<Self> {
        match name {
            "tum" => Ok(Self::Tum),
            "kitti" => Ok(Self::Kitti),
            "euroc" => Ok(Self::Euroc),
            _ => {
                let expected = "`tum`, `kitti` or `euroc`";
                Err(sphereflow_core::Error::value("format", expected, format!("`{name}`")).into())
            }
        }
    }
}

/// The format of a trajectory file, by its first row: an integer stamp of 16 digits or more begins
/// a EuRoC row, twelve columns are KITTI, eight are TUM.
///
/// # Errors
/// [`Error::Line`] where the first row is none of these, [`Error::Content`] without rows.
pub fn guess_format(path: &Path) -> Result<TrajectoryFormat> {
    let text = read_text(path)?;
    let row = rows(path, &text)
        .next()
        .ok_or_else(|| Error::content(path, "a trajectory", "no rows"))?;
    let first = row.text(0);
    let nanoseconds =
        first.len() >= NANOSECOND_DIGITS && first.bytes().all(|byte| byte.is_ascii_digit());
    match row.fields.len() {
        n if n >= 8 && nanoseconds => Ok(TrajectoryFormat::Euroc),
        12 => Ok(TrajectoryFormat::Kitti),
        8 => Ok(TrajectoryFormat::Tum),
        n => Err(row.error(
            "a row of 8 columns (TUM), 12 (KITTI), or integer nanoseconds and at least 7 more \
             (EuRoC)",
            format!("{n} columns"),
        )),
    }
}
