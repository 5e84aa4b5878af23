//! Which trajectory format a file is in.

use crate::rows::{read_text, rows};
use crate::{Error, Result};
use std::fmt;
use std::path::Path;
use std::str::FromStr;

/// No clock shows this many seconds: such a time counts something finer, as EuRoC's does. 10^14 ns
/// are a day.
const FINER_THAN_SECONDS: f64 = 1e14;

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

/// The format of a trajectory file, by its first row: a time of 1e14 or more before a comma begins a
/// EuRoC row, twelve columns are KITTI, eight are TUM.
///
/// # Errors
/// [`Error::Line`] where the first row is none of these, [`Error::Content`] without rows.
pub fn guess_format(path: &Path) -> Result<TrajectoryFormat> {
    let text = read_text(path)?;
    let row = rows(path, &text)
        .next()
        .ok_or_else(|| Error::content(path, "a trajectory", "no rows"))?;
    let finer = row
        .text(0)
        .parse()
        .is_ok_and(|t: f64| t >= FINER_THAN_SECONDS);
    let commas = text
        .lines()
        .nth(row.line - 1)
        .is_some_and(|l| l.contains([',', ';']));
    match row.fields.len() {
        n if n >= 8 && finer && commas => Ok(TrajectoryFormat::Euroc),
        12 => Ok(TrajectoryFormat::Kitti),
        8 => Ok(TrajectoryFormat::Tum),
        n => Err(row.error(
            "a row of 8 columns (TUM), 12 (KITTI), or integer nanoseconds and at least 7 more \
             (EuRoC)",
            format!("{n} columns"),
        )),
    }
}
