//! The unit of a table's times: what its format says, unless the numbers cannot be that.

use crate::rows::rows;
use crate::{Error, Result, Warnings};
use sphereflow_core::Stamp;
use std::fmt;
use std::path::Path;

/// Units of time in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unit {
    Seconds,
    Milliseconds,
    Microseconds,
    Nanoseconds,
}

const UNITS: [Unit; 4] = [
    Unit::Seconds,
    Unit::Milliseconds,
    Unit::Microseconds,
    Unit::Nanoseconds,
];

/// Seconds since 1970 from 2000 to 2100: a time in a unit that falls here is Unix time in it.
const UNIX_S: std::ops::Range<f64> = 9.4e8..4.2e9;
/// Intervals of every sensor and trajectory that we know of, seconds. Wider: fewer wrong units are
/// noticed; narrower: slow key poses or fast gyros are taken for another unit.
const POSSIBLE_INTERVAL_S: std::ops::RangeInclusive<f64> = 5e-5..=10.0;
/// The interval, in seconds, that the unit of a clock without date is chosen for: 60 Hz lies in the
/// middle between key poses and gyros on a scale of ratios.
const USUAL_INTERVAL_S: f64 = 1.0 / 60.0;
/// Rows that the interval is measured over; more only take time.
const ROWS: usize = 2000;

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Seconds => "decimal seconds",
            Self::Milliseconds => "milliseconds",
            Self::Microseconds => "microseconds",
            Self::Nanoseconds => "integer nanoseconds",
        })
    }
}

impl Unit {
    fn exponent(self) -> i32 {
        match self {
            Self::Seconds => 0,
            Self::Milliseconds => -3,
            Self::Microseconds => -6,
            Self::Nanoseconds => -9,
        }
    }

    fn seconds(self) -> f64 {
        10.0_f64.powi(self.exponent())
    }

    /// The stamp that a text in this unit is, exactly; `None` where it is no number.
    pub fn parse(self, text: &str) -> Option<Stamp> {
        if self == Self::Seconds {
            return text.parse().ok();
        }
        if self == Self::Nanoseconds
            && let Ok(ns) = text.parse()
        {
            return Some(Stamp::from_ns(ns));
        }
        let (mantissa, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
        let exponent = exponent.parse::<i32>().ok()?.checked_add(self.exponent())?;
        format!("{mantissa}e{exponent}").parse().ok()
    }
}

/// The unit of column `column`: `usual` unless the numbers are plainly Unix time in another unit,
/// or their rate is impossible in it; that is a guess, and said.
pub(crate) fn unit(
    path: &Path,
    text: &str,
    column: usize,
    usual: Unit,
    warnings: &mut Warnings,
) -> Unit {
    let (found, because) = recognise(&numbers(path, text, column), usual);
    if found != usual {
        let told = format!("times taken for {found} instead of {usual}");
        warnings.add(&told, || because);
    }
    found
}

/// As [`unit`] where a guess cannot be said: an error that names the unit.
///
/// # Errors
/// [`Error::Content`] where the times are of another unit than `usual`.
pub(crate) fn check_unit(path: &Path, text: &str, usual: Unit) -> Result<()> {
    let (found, because) = recognise(&numbers(path, text, 0), usual);
    match found == usual {
        true => Ok(()),
        false => Err(Error::content(
            path,
            format!("times in {usual}"),
            format!("what looks like {found} ({because})"),
        )),
    }
}

fn numbers(path: &Path, text: &str, column: usize) -> Vec<f64> {
    rows(path, text)
        .take(ROWS)
        .filter_map(|row| row.text(column).parse().ok())
        .filter(|value: &f64| value.is_finite())
        .collect()
}

/// The unit, and what speaks for it.
fn recognise(values: &[f64], usual: Unit) -> (Unit, String) {
    let Some(&first) = values.first() else {
        return (usual, String::new());
    };
    let dated = |unit: &Unit| UNIX_S.contains(&(first * unit.seconds()));
    if let Some(unit) = UNITS.into_iter().find(dated) {
        return (
            unit,
            format!("the first, {first}, is then a date from 2000 to 2100"),
        );
    }
    let mut steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.retain(|step| *step > 0.0);
    steps.sort_by(f64::total_cmp);
    let Some(&step) = steps.get(steps.len() / 2) else {
        return (usual, String::new());
    };
    // Fractions of a second are seconds in every format; a count has none.
    let counts = values.iter().all(|value| value.fract() == 0.0);
    if !counts || POSSIBLE_INTERVAL_S.contains(&(step * usual.seconds())) {
        return (usual, String::new());
    }
    let far = |unit: &Unit| (step * unit.seconds() / USUAL_INTERVAL_S).ln().abs();
    let nearest = UNITS.into_iter().min_by(|a, b| far(a).total_cmp(&far(b)));
    let unit = nearest.unwrap_or(usual);
    (
        unit,
        format!(
            "a median interval of {step} is {:.3} s",
            step * unit.seconds()
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_parses_exactly_with_and_without_exponent() {
        let ns = |unit: Unit, text: &str| unit.parse(text).map(Stamp::ns);
        assert_eq!(ns(Unit::Seconds, "12.5"), Some(12_500_000_000));
        assert_eq!(
            ns(Unit::Milliseconds, "1500000000123"),
            Some(1_500_000_000_123_000_000)
        );
        assert_eq!(
            ns(Unit::Microseconds, "1500000000123456"),
            Some(1_500_000_000_123_456_000)
        );
        assert_eq!(
            ns(Unit::Nanoseconds, "1.5e+18"),
            Some(1_500_000_000_000_000_000)
        );
        assert_eq!(ns(Unit::Nanoseconds, "7 oxen"), None);
    }

    #[test]
    fn unit_is_recognised_by_date_and_by_rate() {
        let at = |start: f64, step: f64, usual| {
            let values: Vec<f64> = (0..50).map(|k| start + step * f64::from(k)).collect();
            recognise(&values, usual).0
        };
        assert_eq!(at(1.5e12, 33.0, Unit::Seconds), Unit::Milliseconds);
        assert_eq!(at(1.5e15, 33_333.0, Unit::Nanoseconds), Unit::Microseconds);
        assert_eq!(at(1.5e9, 0.033, Unit::Nanoseconds), Unit::Seconds);
        assert_eq!(at(1.5e18, 5e6, Unit::Seconds), Unit::Nanoseconds);
        // A clock that began when the device was switched on.
        assert_eq!(at(90_000.0, 5_000.0, Unit::Nanoseconds), Unit::Microseconds);
        assert_eq!(at(0.0, 33_333_333.0, Unit::Seconds), Unit::Nanoseconds);
        assert_eq!(at(0.0, 1.0, Unit::Seconds), Unit::Seconds);
        assert_eq!(at(0.0, 5_000_000.0, Unit::Nanoseconds), Unit::Nanoseconds);
    }
}
