//! Stable codes of reasons: what programs branch on, while the words for people may change.

use std::borrow::Cow;

/// One of the values that decided.
#[derive(Clone, Debug, PartialEq)]
pub enum ReasonValue {
    /// A measured number, in the unit of its name.
    Number(f64),
    /// A number of things.
    Count(usize),
    /// A name, in snake_case.
    Word(Cow<'static, str>),
}

/// A reason that has a code. [`crate::reason_codes!`] implements it.
pub trait ReasonCode: Sized {
    /// Every code with the names of its values, in the order of the variants.
    const CODES: &'static [(&'static str, &'static [&'static str])];

    /// The code, in snake_case; it is never given another meaning.
    fn code(&self) -> &'static str;

    /// The values that decided, by name.
    fn values(&self) -> Vec<(&'static str, ReasonValue)>;

    /// The reason of a code and its values; `None` where there is no such code, or a value is
    /// missing or of another kind.
    fn from_code(code: &str, values: &[(String, ReasonValue)]) -> Option<Self>;
}

/// What can be a value of a reason.
pub trait ReasonField: Sized {
    /// As a value.
    fn value(&self) -> ReasonValue;

    /// From a value; `None` where it is of another kind.
    fn of(value: &ReasonValue) -> Option<Self>;
}

impl ReasonField for f64 {
    fn value(&self) -> ReasonValue {
        ReasonValue::Number(*self)
    }

    fn of(value: &ReasonValue) -> Option<Self> {
        match value {
            ReasonValue::Number(number) => Some(*number),
            ReasonValue::Count(_) | ReasonValue::Word(_) => None,
        }
    }
}

impl ReasonField for usize {
    fn value(&self) -> ReasonValue {
        ReasonValue::Count(*self)
    }

    fn of(value: &ReasonValue) -> Option<Self> {
        match value {
            ReasonValue::Count(count) => Some(*count),
            ReasonValue::Number(_) | ReasonValue::Word(_) => None,
        }
    }
}

/// Implements [`crate::ReasonCode`] for an enum: one line a variant, all of them or it does not
/// compile. `docs/reason-codes.md` lists the codes of all enums.
///
/// ```
/// enum Why {
///     Dark,
///     Few { found: usize },
/// }
/// sphereflow_core::reason_codes! {
///     Why {
///         "dark" => Dark,
///         "few" => Few { found },
///     }
/// }
/// assert_eq!(sphereflow_core::ReasonCode::code(&Why::Few { found: 3 }), "few");
/// assert_eq!(sphereflow_core::ReasonCode::code(&Why::Dark), "dark");
/// ```
#[macro_export]
macro_rules! reason_codes {
    ($reason:ident { $($code:literal => $variant:ident $({ $($field:ident),+ })?,)+ }) => {
        impl $crate::ReasonCode for $reason {
            const CODES: &'static [(&'static str, &'static [&'static str])] =
                &[$(($code, &[$($(stringify!($field)),+)?])),+];

            fn code(&self) -> &'static str {
                match self {
                    $(Self::$variant $({ $($field: _),+ })? => $code,)+
                }
            }

            fn values(&self) -> ::std::vec::Vec<(&'static str, $crate::ReasonValue)> {
                match self {
                    $(Self::$variant $({ $($field),+ })? => ::std::vec![
                        $($((stringify!($field), $crate::ReasonField::value($field))),+)?
                    ],)+
                }
            }

            fn from_code(
                code: &str,
                values: &[(::std::string::String, $crate::ReasonValue)],
            ) -> ::std::option::Option<Self> {
                let _find = |name: &str| values.iter().find(|(other, _)| other == name);
                match code {
                    $($code => ::std::option::Option::Some(Self::$variant $({
                        $($field: $crate::ReasonField::of(&_find(stringify!($field))?.1)?),+
                    })?),)+
                    _ => ::std::option::Option::None,
                }
            }
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Reason;

    #[test]
    fn reason_of_its_own_code_and_values_is_itself() {
        for reason in [
            Reason::NoDepth,
            Reason::FewKnownPixels { share: 0.1 },
            Reason::FewDomains {
                found: 3,
                needed: 40,
            },
            Reason::ImplausibleMotion {
                speed_m_s: 9.0,
                rate_rad_s: 1.0,
            },
        ] {
            let values = reason.values().into_iter();
            let values: Vec<_> = values.map(|(name, v)| (name.to_string(), v)).collect();
            assert_eq!(Reason::from_code(reason.code(), &values), Some(reason));
        }
    }

    #[test]
    fn reason_of_an_unknown_code_or_without_its_values_is_none() {
        assert_eq!(Reason::from_code("nonsense", &[]), None);
        assert_eq!(Reason::from_code("few_known_pixels", &[]), None);
        let count = [("share".to_string(), ReasonValue::Count(1))];
        assert_eq!(Reason::from_code("few_known_pixels", &count), None);
    }

    #[test]
    fn reason_codes_are_snake_case_and_unlike_each_other() {
        let mut codes: Vec<&str> = Reason::CODES.iter().map(|(code, _)| *code).collect();
        let plain = |c: char| c.is_ascii_lowercase() || c == '_';
        assert!(
            codes.iter().all(|code| code.chars().all(plain)),
            "{codes:?}"
        );
        let count = codes.len();
        codes.sort_unstable();
        codes.dedup();
        assert_eq!(codes.len(), count);
    }
}
