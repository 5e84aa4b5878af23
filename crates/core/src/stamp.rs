//! Time as integer nanoseconds; read and written as decimal seconds without ever passing a float.

use crate::{Error, Result};
use std::fmt;
use std::str::FromStr;

/// An instant: nanoseconds of the recording's clock (Unix time where the recording has it).
///
/// `Display` and `FromStr` use decimal seconds with nine decimals and are exact: a Unix time in an
/// `f64` is only good to 0.2 microseconds, which loses matches between trajectories.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Stamp(i64);

const NS_PER_S: i128 = 1_000_000_000;

impl Stamp {
    /// From nanoseconds.
    pub const fn from_ns(ns: i64) -> Self {
        Self(ns)
    }

    /// Nanoseconds.
    pub const fn ns(self) -> i64 {
        self.0
    }

    /// Seconds from `earlier` to `self`; negative where `earlier` is later. Exact to the
    /// rounding of the difference, never of the two stamps.
    pub fn seconds_since(self, earlier: Stamp) -> f64 {
        (i128::from(self.0) - i128::from(earlier.0)) as f64 * 1e-9
    }

    /// The stamp `dt_s` seconds later, rounded to the nanosecond and saturating at the ends of time.
    pub fn plus_seconds(self, dt_s: f64) -> Self {
        Self(self.0.saturating_add((dt_s * 1e9).round() as i64))
    }

    /// Absolute difference in nanoseconds.
    pub const fn abs_diff_ns(self, other: Stamp) -> u64 {
        self.0.abs_diff(other.0)
    }
}

impl fmt::Display for Stamp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.0 < 0 { "-" } else { "" };
        let magnitude = self.0.unsigned_abs();
        write!(
            f,
            "{sign}{}.{:09}",
            magnitude / 1_000_000_000,
            magnitude % 1_000_000_000
        )
    }
}

impl FromStr for Stamp {
    type Err = Error;

    /// Decimal seconds: `1305031229.528748`, `12`, `-0.5`, `1.403715529112143517e+09`.
    /// More than nine decimals are rounded half away from zero.
    fn from_str(text: &str) -> Result<Self> {
        parse_decimal_ns(text.trim())
            .and_then(|ns| i64::try_from(ns).ok())
            .map(Self)
            .ok_or_else(|| Error::value("stamp", "decimal seconds within the year 2262", text))
    }
}

/// `None` where `text` is no decimal number, or has more digits than any clock.
fn parse_decimal_ns(text: &str) -> Option<i128> {
    let (mantissa, exponent) = match text.split_once(['e', 'E']) {
        Some((m, e)) => (m, e.parse::<i32>().ok()?),
        None => (text, 0),
    };
    let (negative, digits) = match mantissa.as_bytes().first()? {
        b'-' => (true, &mantissa[1..]),
        b'+' => (false, &mantissa[1..]),
        _ => (false, mantissa),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let count = whole.len() + fraction.len();
    if count == 0 || count > 36 || !(-36..=36).contains(&exponent) {
        return None;
    }
    let mut value: i128 = 0;
    for byte in whole.bytes().chain(fraction.bytes()) {
        if !byte.is_ascii_digit() {
            return None;
        }
        value = value
            .checked_mul(10)?
            .checked_add(i128::from(byte - b'0'))?;
    }
    let shift = 9 + exponent - i32::try_from(fraction.len()).ok()?;
    let ns = if shift >= 0 {
        value.checked_mul(10_i128.checked_pow(shift.unsigned_abs())?)?
    } else {
        match 10_i128.checked_pow(shift.unsigned_abs()) {
            Some(divisor) => (value + divisor / 2) / divisor,
            None => 0,
        }
    };
    (ns < 10 * NS_PER_S * NS_PER_S).then_some(if negative { -ns } else { ns })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn stamp_text_of_unix_time_keeps_every_digit() {
        let stamp: Stamp = "1305031229.528748".parse().unwrap();
        assert_eq!(stamp.ns(), 1_305_031_229_528_748_000);
        assert_eq!(stamp.to_string(), "1305031229.528748000");
        let sci: Stamp = "1.403715529112143517e+09".parse().unwrap();
        assert_eq!(sci.ns(), 1_403_715_529_112_143_517);
        let neg: Stamp = "-0.5".parse().unwrap();
        assert_eq!(
            (neg.ns(), neg.to_string()),
            (-500_000_000, "-0.500000000".into())
        );
        let rounded: Stamp = "0.0000000015".parse().unwrap();
        assert_eq!(rounded.ns(), 2);
    }

    #[test]
    fn stamp_text_that_is_no_number_is_an_error() {
        for text in [
            "",
            ".",
            "-",
            "abc",
            "1.2.3",
            "1e",
            "nan",
            "inf",
            "1e30",
            "9999999999999",
            "1 2",
        ] {
            assert!(
                text.parse::<Stamp>().is_err(),
                "{text:?} was read as a stamp"
            );
        }
    }

    #[test]
    fn stamp_difference_is_exact_where_a_float_of_unix_time_is_not() {
        let a = Stamp::from_ns(1_403_715_529_112_143_517);
        let b = Stamp::from_ns(1_403_715_529_112_143_518);
        assert_eq!(b.seconds_since(a), 1e-9);
        assert_eq!(a.plus_seconds(1e-9), b);
    }

    proptest! {
        #[test]
        fn stamp_display_then_parse_is_identity(ns in any::<i64>()) {
            let stamp = Stamp::from_ns(ns);
            prop_assert_eq!(stamp.to_string().parse::<Stamp>().unwrap(), stamp);
        }

        #[test]
        fn stamp_parse_never_panics(text in ".{0,40}") {
            let _ = text.parse::<Stamp>();
        }
    }
}
