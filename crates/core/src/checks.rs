//! Checks of single numbers: an error that names the argument, what was expected and what was found.

use crate::{Error, Result};
use std::fmt::Display;
use std::ops::RangeInclusive;

/// # Errors
/// [`Error::Value`] where `value` is not finite.
pub fn finite(argument: &str, value: f64) -> Result<()> {
    if value.is_finite() {
        return Ok(());
    }
    Err(Error::value(argument, "a finite number", value))
}

/// # Errors
/// [`Error::Value`] naming the first of `values` that is not finite.
pub fn all_finite<'a>(argument: &str, values: impl IntoIterator<Item = &'a f64>) -> Result<()> {
    match values.into_iter().find(|value| !value.is_finite()) {
        None => Ok(()),
        Some(value) => Err(Error::value(argument, "finite numbers", value)),
    }
}

/// # Errors
/// [`Error::Value`] where `value` is not finite or not above zero.
pub fn positive(argument: &str, value: f64) -> Result<()> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Error::value(argument, "a positive number", value))
}

/// # Errors
/// [`Error::Value`] where `value` is not finite or below zero.
pub fn non_negative(argument: &str, value: f64) -> Result<()> {
    if value.is_finite() && value >= 0.0 {
        return Ok(());
    }
    Err(Error::value(argument, "a number, not negative", value))
}

/// # Errors
/// [`Error::Value`] where `value` is not from 0 to 1.
pub fn share(argument: &str, value: f64) -> Result<()> {
    if (0.0..=1.0).contains(&value) {
        return Ok(());
    }
    Err(Error::value(argument, "0 to 1", value))
}

/// # Errors
/// [`Error::Value`] where `value` is outside `range` (also where it is NaN).
pub fn within<T: PartialOrd + Display>(
    argument: &str,
    value: T,
    range: RangeInclusive<T>,
) -> Result<()> {
    if range.contains(&value) {
        return Ok(());
    }
    let expected = format!("{} to {}", range.start(), range.end());
    Err(Error::value(argument, expected, value))
}

/// The same check of several arguments: the first that fails.
///
/// # Errors
/// Those of `check`.
pub fn each<T: Copy>(check: impl Fn(&str, T) -> Result<()>, arguments: &[(&str, T)]) -> Result<()> {
    arguments
        .iter()
        .try_for_each(|(argument, value)| check(argument, *value))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(result: Result<()>) -> String {
        result.unwrap_err().to_string()
    }

    #[test]
    fn checks_name_the_argument_the_expectation_and_what_was_found() {
        assert_eq!(
            text(positive("gain", -1.0)),
            "gain: expected a positive number, found -1"
        );
        assert_eq!(text(share("part", 1.5)), "part: expected 0 to 1, found 1.5");
        assert_eq!(
            text(within("levels", 9, 1..=6)),
            "levels: expected 1 to 6, found 9"
        );
        let row = each(positive, &[("a", 1.0), ("b", 0.0), ("c", -1.0)]);
        assert!(text(row).starts_with("b:"));
        assert!(text(all_finite("row", &[0.0, f64::INFINITY])).ends_with("inf"));
    }

    #[test]
    fn checks_refuse_nan_and_infinity() {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(finite("x", value).is_err(), "{value}");
            assert!(positive("x", value).is_err(), "{value}");
            assert!(non_negative("x", value).is_err(), "{value}");
            assert!(share("x", value).is_err(), "{value}");
            assert!(within("x", value, 0.0..=1.0).is_err(), "{value}");
        }
        assert!(non_negative("x", 0.0).is_ok() && finite("x", -3.0).is_ok());
    }
}
