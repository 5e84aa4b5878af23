//! What can be wrong with a value handed to the library: which argument, what was expected, what was found.

use crate::Stamp;

/// Errors of the core vocabulary. Other crates wrap it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// An array or image has the wrong size.
    #[error("{argument}: expected shape {expected}, found {found}")]
    Shape {
        /// Name of the argument.
        argument: String,
        /// What was expected, in words or numbers.
        expected: String,
        /// What was found.
        found: String,
    },
    /// A number is outside its domain (NaN in an intrinsic, a negative focal length, ...).
    #[error("{argument}: expected {expected}, found {found}")]
    Value {
        /// Name of the argument.
        argument: String,
        /// What was expected, in words or numbers.
        expected: String,
        /// What was found.
        found: String,
    },
    /// Stamps do not increase.
    #[error("{argument}: stamps must increase, but {later} s follows {earlier} s (index {index})")]
    TimeOrder {
        /// Name of the argument.
        argument: String,
        /// The stamp before.
        earlier: Stamp,
        /// The stamp that does not come after it.
        later: Stamp,
        /// Index of `later`.
        index: usize,
    },
}

impl Error {
    /// A [`Error::Shape`] from anything that prints.
    pub fn shape(
        argument: impl Into<String>,
        expected: impl ToString,
        found: impl ToString,
    ) -> Self {
        Self::Shape {
            argument: argument.into(),
            expected: expected.to_string(),
            found: found.to_string(),
        }
    }

    /// A [`Error::Value`] from anything that prints.
    pub fn value(
        argument: impl Into<String>,
        expected: impl ToString,
        found: impl ToString,
    ) -> Self {
        Self::Value {
            argument: argument.into(),
            expected: expected.to_string(),
            found: found.to_string(),
        }
    }
}
