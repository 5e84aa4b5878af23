//! What can be wrong with a call.

/// Errors of the observers: settings and shapes. What is wrong with a *sample* is a
/// [`crate::Status`] with a reason, for a sensor that fails must not end a recording.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A value or a size is wrong: names the argument, what was expected and what was found.
    #[error(transparent)]
    Core(#[from] sphereflow_core::Error),
}
