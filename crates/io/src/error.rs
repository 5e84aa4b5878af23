//! What can be wrong with a file: which one, where in it, what was expected, what was found.

use std::path::{Path, PathBuf};

/// Errors of reading and writing files.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The system refused.
    #[error("{}: cannot {action}: {source}", path.display())]
    System {
        /// The file or folder.
        path: PathBuf,
        /// What was tried: `read`, `write`, ...
        action: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// A line of a text file is not what its format says.
    #[error("{}:{line}: expected {expected}, found {found}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Line number, from 1.
        line: usize,
        /// What was expected.
        expected: String,
        /// What was found.
        found: String,
    },
    /// A file as a whole is not what it should be (truncated image, wrong size, no poses, ...).
    #[error("{}: expected {expected}, found {found}", path.display())]
    Content {
        /// The file or folder.
        path: PathBuf,
        /// What was expected.
        expected: String,
        /// What was found.
        found: String,
    },
    /// A field of a calibration file is wrong.
    #[error("{}: field `{field}`: {message}", path.display())]
    Calibration {
        /// The file.
        path: PathBuf,
        /// The field, with the name of its table.
        field: String,
        /// What is wrong.
        message: String,
    },
    /// A folder is no recording that can be read.
    #[error("{}: no recording found; looked for {looked_for}; found {found}", path.display())]
    NotARecording {
        /// The folder.
        path: PathBuf,
        /// The files that would have told.
        looked_for: String,
        /// What is there.
        found: String,
    },
    /// A wrong argument.
    #[error(transparent)]
    Core(#[from] sphereflow_core::Error),
}

impl Error {
    /// A [`Error::System`], to be used as `map_err(Error::system(path, "read"))`.
    pub(crate) fn system<'a>(
        path: &'a Path,
        action: &'static str,
    ) -> impl FnOnce(std::io::Error) -> Self + 'a {
        move |source| Self::System {
            path: path.to_path_buf(),
            action,
            source,
        }
    }

    /// A [`Error::Content`] from anything that prints.
    pub(crate) fn content(path: &Path, expected: impl ToString, found: impl ToString) -> Self {
        Self::Content {
            path: path.to_path_buf(),
            expected: expected.to_string(),
            found: found.to_string(),
        }
    }

    /// A [`Error::Line`] from anything that prints.
    pub(crate) fn line(
        path: &Path,
        line: usize,
        expected: impl ToString,
        found: impl ToString,
    ) -> Self {
        Self::Line {
            path: path.to_path_buf(),
            line,
            expected: expected.to_string(),
            found: found.to_string(),
        }
    }
}

/// Result of the crate's fallible calls.
pub type Result<T> = std::result::Result<T, Error>;
