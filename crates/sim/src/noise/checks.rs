//! Checks of configuration numbers: each error names the parameter, what it may be and what it was.

use sphereflow_core::{Error, Result};

/// A standard deviation, a step, a rate of noise: finite and not negative.
pub(crate) fn non_negative(name: &str, value: f64) -> Result<()> {
    require(name, "a finite number, zero or more", value, value >= 0.0)
}

/// A rate, a range: finite and above zero.
pub(crate) fn positive(name: &str, value: f64) -> Result<()> {
    require(name, "a finite number above zero", value, value > 0.0)
}

/// Any finite number.
pub(crate) fn finite(name: &str, value: f64) -> Result<()> {
    require(name, "a finite number", value, true)
}

/// A share: from 0 to below 1.
pub(crate) fn share(name: &str, value: f64) -> Result<()> {
    require(
        name,
        "a share from 0 to below 1",
        value,
        (0.0..1.0).contains(&value),
    )
}

/// Every component finite.
pub(crate) fn finite_all<'a>(name: &str, values: impl IntoIterator<Item = &'a f64>) -> Result<()> {
    values.into_iter().try_for_each(|v| finite(name, *v))
}

fn require(name: &str, expected: &str, value: f64, holds: bool) -> Result<()> {
    if value.is_finite() && holds {
        return Ok(());
    }
    Err(Error::value(name, expected, value))
}
