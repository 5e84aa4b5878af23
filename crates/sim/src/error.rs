//! What can go wrong in a simulation: a value out of its domain, a file that cannot be written.

/// Errors of the simulator.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An argument or a setting is wrong: named, with what was expected and found.
    #[error(transparent)]
    Core(#[from] sphereflow_core::Error),
    /// A recording could not be written.
    #[error(transparent)]
    Io(#[from] sphereflow_io::Error),
    /// A problem could not be stated.
    #[error(transparent)]
    Solver(#[from] sphereflow_solver::Error),
}

impl Error {
    /// An argument outside its domain.
    pub(crate) fn value(
        argument: impl Into<String>,
        expected: impl ToString,
        found: impl ToString,
    ) -> Self {
        Self::Core(sphereflow_core::Error::value(argument, expected, found))
    }
}

/// Result of the crate's fallible calls.
pub type Result<T> = std::result::Result<T, Error>;
