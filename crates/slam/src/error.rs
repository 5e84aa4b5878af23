//! What can be wrong with a call.

/// Errors of the map.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A value or a size is wrong: names the argument, what was expected and what was found.
    #[error(transparent)]
    Core(#[from] sphereflow_core::Error),
}
