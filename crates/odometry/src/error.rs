//! What can be wrong with a call: wrong sizes and impossible settings. A frame that cannot be used
//! is no error but a status.

/// Errors of the odometry.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A value or a size is wrong: names the argument, what was expected and what was found.
    #[error(transparent)]
    Core(#[from] sphereflow_core::Error),
}
