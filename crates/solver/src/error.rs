//! What can be wrong with a call: wrong values, indices, and matrices that are no covariance.

/// Errors of the solver. A problem that cannot be solved well is no error but is named in the summary.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A value or a size is wrong: names the argument, what was expected and what was found.
    #[error(transparent)]
    Core(#[from] sphereflow_core::Error),
    /// The covariance asked for does not exist: something is not determined by the measurements.
    #[error("no covariance: {reason}")]
    NoCovariance {
        /// What is not determined.
        reason: String,
    },
}

impl Error {
    /// A value error from anything that prints.
    pub(crate) fn value(
        argument: impl Into<String>,
        expected: impl ToString,
        found: impl ToString,
    ) -> Self {
        sphereflow_core::Error::value(argument, expected, found).into()
    }
}

/// Result of the crate's fallible calls.
pub type Result<T> = std::result::Result<T, Error>;
