//! What can be wrong with a device: which one, what was tried, what was expected, what was found.

/// Errors of opening and reading devices.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A wrong argument.
    #[error(transparent)]
    Core(#[from] sphereflow_core::Error),
    /// A device answered something that its protocol does not allow.
    #[error("{device}: {action}: expected {expected}, found {found}")]
    Protocol {
        /// Which device.
        device: String,
        /// What was asked of it.
        action: String,
        /// What its protocol says.
        expected: String,
        /// What it said.
        found: String,
    },
    /// The device is not there.
    #[error("{wanted}: no such device; found {found}")]
    NoDevice {
        /// What was looked for.
        wanted: String,
        /// What is there instead.
        found: String,
    },
    /// The device went away while it was in use.
    #[error("{device}: unplugged, or its bus was reset")]
    Unplugged {
        /// Which device.
        device: String,
    },
    /// The system or a library refused.
    #[error("{device}: cannot {action}: {reason}")]
    System {
        /// Which device or library.
        device: String,
        /// What was tried: `open`, `claim interface 0`, ...
        action: String,
        /// What the system said, and what helps.
        reason: String,
    },
    /// No answer in time.
    #[error("{device}: no answer within {seconds} s to {action}")]
    Timeout {
        /// Which device.
        device: String,
        /// What was asked.
        action: String,
        /// How long was waited.
        seconds: f64,
    },
}

impl Error {
    /// A [`Error::Protocol`] from anything that prints.
    pub(crate) fn protocol(
        device: impl ToString,
        action: impl ToString,
        expected: impl ToString,
        found: impl ToString,
    ) -> Self {
        Self::Protocol {
            device: device.to_string(),
            action: action.to_string(),
            expected: expected.to_string(),
            found: found.to_string(),
        }
    }
}

/// Result of the crate's fallible calls.
pub type Result<T> = std::result::Result<T, Error>;
