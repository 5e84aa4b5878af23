//! Bundle adjustment problems (BAL, Bundler, libmv) and pose graphs (g2o).

mod bal;
mod bundler;
mod g2o;
mod landmarks;
mod libmv;
mod snavely;
mod tokens;

pub use g2o::{PoseGraphFile, read_g2o, write_g2o};

use crate::Result;
use crate::rows::{read_bytes, read_text};
use sphereflow_solver::bundle::BundleProblem;
use std::path::Path;

/// The format of a bundle adjustment file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BundleFormat {
    /// "Bundle Adjustment in the Large": text, one camera of three intrinsics a pose.
    Bal,
    /// Bundler's `bundle.out`, version 0.3: the same cameras.
    Bundler,
    /// libmv's binary problems: one camera with radial and tangential distortion.
    Libmv,
}

/// A bundle adjustment problem from a file.
#[derive(Clone, Debug)]
pub struct BundleFile {
    /// The problem, with covariances of one pixel; nothing in it is fixed. Intrinsics are free: focal
    /// length, k1 and k2 of each camera (BAL, Bundler), or fixed (libmv).
    pub problem: BundleProblem,
    /// What the file was.
    pub format: BundleFormat,
    /// The file's names of poses and points (libmv), by index.
    names: libmv::Names,
}

/// Read a bundle adjustment problem; the format is found from the content.
///
/// # Errors
/// Where the file cannot be read or is none of these, naming the line where there are lines.
pub fn read_bundle(path: &Path) -> Result<BundleFile> {
    let bytes = read_bytes(path)?;
    crate::packed::refuse(path, &bytes, "a bundle adjustment problem")?;
    if matches!(bytes.first(), Some(b'v' | b'V')) {
        let (problem, names) = libmv::read(path, &bytes)?;
        let format = BundleFormat::Libmv;
        return Ok(BundleFile {
            problem,
            format,
            names,
        });
    }
    let text = read_text(path)?;
    let names = libmv::Names::default();
    let (problem, format) = if text.trim_start().starts_with("# Bundle file") {
        (bundler::read(path, &text)?, BundleFormat::Bundler)
    } else {
        (bal::read(path, &text)?, BundleFormat::Bal)
    };
    Ok(BundleFile {
        problem,
        format,
        names,
    })
}

impl BundleFile {
    /// Write the problem in its present state: libmv's as libmv's, the others as BAL.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        match self.format {
            BundleFormat::Libmv => libmv::write(path, &self.problem, &self.names),
            _ => bal::write(path, &self.problem),
        }
    }
}
