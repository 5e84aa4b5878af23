//! What can be wrong with a call: wrong sizes and impossible settings. An image or a motion that
//! says nothing about depth is no error but a status.

/// Errors of optical flow and dense depth.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A value or a size is wrong: names the argument, what was expected and what was found.
    #[error(transparent)]
    Core(#[from] sphereflow_core::Error),
}

impl Error {
    pub(crate) fn shape(argument: &str, expected: (usize, usize), found: (usize, usize)) -> Self {
        let text = |(width, height): (usize, usize)| format!("({height}, {width})");
        sphereflow_core::Error::shape(argument, text(expected), text(found)).into()
    }

    pub(crate) fn value(argument: &str, expected: &str, found: impl ToString) -> Self {
        sphereflow_core::Error::value(argument, expected, found).into()
    }
}

/// Refuses a setting that is not a positive finite number.
pub(crate) fn positive(argument: &str, value: f64) -> crate::Result<()> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Error::value(argument, "a positive finite number", value))
}

/// Refuses an image of another size.
pub(crate) fn same_size(
    argument: &str,
    expected: (usize, usize),
    found: (usize, usize),
) -> crate::Result<()> {
    if expected == found {
        return Ok(());
    }
    Err(Error::shape(argument, expected, found))
}
