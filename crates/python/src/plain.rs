//! Rust values as plain Python ones and back, bit for bit: what pickles, copies and settings are made of.

mod geometry;
mod motion;
mod observers;
mod status;

pub use motion::{CALIBRATION_CODES, calibration_code};
pub use status::{reason_codes, reason_values};

use crate::errors::{Kind, exception};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyString, PyTuple};
use std::time::Duration;

/// A value that plain Python values (numbers, strings, tuples, dicts) can stand for.
pub trait Plain: Sized {
    /// As plain values.
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>>;

    /// From plain values, as [`Plain::to_plain`] gives them.
    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self>;
}

/// The field `key` of a dict.
pub fn field<T: Plain>(dict: &Bound<'_, PyDict>, key: &str) -> PyResult<T> {
    T::from_plain(&item(dict, key)?)
}

/// The value `key` of a dict.
pub fn item<'py>(dict: &Bound<'py, PyDict>, key: &str) -> PyResult<Bound<'py, PyAny>> {
    dict.get_item(key)?.ok_or_else(|| {
        let text = format!("{key}: expected a value, found none");
        exception(Kind::Value, text)
    })
}

/// The exception for plain values that are not what [`Plain::to_plain`] gives.
pub fn not_plain(expected: &str, found: &Bound<'_, PyAny>) -> PyErr {
    let found = found.repr().map_or_else(|_| "?".into(), |r| r.to_string());
    exception(Kind::Value, format!("expected {expected}, found {found}"))
}

/// A value as a dict.
pub fn dict_of<'a, 'py>(value: &'a Bound<'py, PyAny>) -> PyResult<&'a Bound<'py, PyDict>> {
    value
        .cast::<PyDict>()
        .map_err(|_| not_plain("a dict", value))
}

/// The key of a field: its name, or the word that is given.
macro_rules! key {
    ($field:ident) => {
        stringify!($field)
    };
    ($field:ident $word:literal) => {
        $word
    };
}
pub(crate) use key;

/// Implements [`Plain`] for a struct whose fields are all named, as a dict: a field that is
/// forgotten does not compile. `as` gives another key, what stands after `skip` takes its default.
macro_rules! plain_struct {
    ($name:ident { $($field:ident $(as $word:literal)?),+ $(,)? } $(skip { $($skipped:ident),+ })?) => {
        impl $crate::plain::Plain for $name {
            fn to_plain<'py>(
                &self,
                py: ::pyo3::Python<'py>,
            ) -> ::pyo3::PyResult<::pyo3::Bound<'py, ::pyo3::PyAny>> {
                let $name { $($field,)+ $($($skipped: _,)+)? } = self;
                let dict = ::pyo3::types::PyDict::new(py);
                $(::pyo3::types::PyDictMethods::set_item(
                    &dict,
                    $crate::plain::key!($field $($word)?),
                    $crate::plain::Plain::to_plain($field, py)?,
                )?;)+
                Ok(dict.into_any())
            }

            fn from_plain(
                value: &::pyo3::Bound<'_, ::pyo3::PyAny>,
            ) -> ::pyo3::PyResult<Self> {
                let dict = $crate::plain::dict_of(value)?;
                Ok($name {
                    $($field: $crate::plain::field(
                        dict,
                        $crate::plain::key!($field $($word)?),
                    )?,)+
                    $($($skipped: ::std::default::Default::default(),)+)?
                })
            }
        }
    };
}
pub(crate) use plain_struct;

/// Implements [`Plain`] and [`Named`] for an enum without fields, as strings.
macro_rules! plain_names {
    ($name:ident { $($word:literal => $variant:ident),+ $(,)? }) => {
        impl $crate::plain::Named for $name {
            const WORDS: &'static [(&'static str, Self)] = &[$(($word, $name::$variant)),+];
        }

        impl $crate::plain::Plain for $name {
            fn to_plain<'py>(
                &self,
                py: ::pyo3::Python<'py>,
            ) -> ::pyo3::PyResult<::pyo3::Bound<'py, ::pyo3::PyAny>> {
                let words = <Self as $crate::plain::Named>::WORDS.iter();
                let word = words.filter(|(_, value)| value == self).map(|(word, _)| *word);
                $crate::plain::Plain::to_plain(&word.collect::<String>(), py)
            }

            fn from_plain(
                value: &::pyo3::Bound<'_, ::pyo3::PyAny>,
            ) -> ::pyo3::PyResult<Self> {
                let word = <String as $crate::plain::Plain>::from_plain(value)?;
                $crate::plain::named(&word, "value")
            }
        }
    };
}
pub(crate) use plain_names;

/// An enum without fields, whose values have words.
pub trait Named: Sized + Copy + 'static {
    /// Each word with its value.
    const WORDS: &'static [(&'static str, Self)];
}

/// The value of a word; the error names the argument and all words.
pub fn named<T: Named>(word: &str, argument: &str) -> PyResult<T> {
    let found = T::WORDS.iter().find(|(name, _)| *name == word);
    found.map(|(_, value)| *value).ok_or_else(|| {
        let words: Vec<String> = T::WORDS.iter().map(|(w, _)| format!("'{w}'")).collect();
        let expected = match words.split_last() {
            Some((last, [])) => last.clone(),
            Some((last, rest)) => format!("{} or {last}", rest.join(", ")),
            None => "nothing".into(),
        };
        let text = format!("{argument}: expected {expected}, found '{word}'");
        exception(Kind::Value, text)
    })
}

impl Plain for f64 {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(PyFloat::new(py, *self).into_any())
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        value.extract().map_err(|_| not_plain("a number", value))
    }
}

/// As the shortest decimal number that is the same float: 0.1 is 0.1.
impl Plain for f32 {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let shortest = self.to_string().parse::<f64>();
        shortest.unwrap_or(f64::from(*self)).to_plain(py)
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        f64::from_plain(value).map(|value| value as f32)
    }
}

/// Integers convert through Python's own.
macro_rules! plain_integer {
    ($($name:ty),+) => {$(
        impl Plain for $name {
            fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                Ok(self.into_pyobject(py)?.into_any())
            }

            fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
                value.extract().map_err(|_| not_plain("an integer", value))
            }
        }
    )+};
}
plain_integer!(usize, u32, i64, u64);

impl Plain for bool {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(PyBool::new(py, *self).to_owned().into_any())
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        value.extract().map_err(|_| not_plain("a bool", value))
    }
}

impl Plain for String {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(PyString::new(py, self).into_any())
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        value.extract().map_err(|_| not_plain("a string", value))
    }
}

/// To the nanosecond.
impl Plain for Duration {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        u64::try_from(self.as_nanos())
            .unwrap_or(u64::MAX)
            .to_plain(py)
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        u64::from_plain(value).map(Self::from_nanos)
    }
}

impl<T: Plain> Plain for Option<T> {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match self {
            Some(value) => value.to_plain(py),
            None => Ok(py.None().into_bound(py)),
        }
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if value.is_none() {
            return Ok(None);
        }
        T::from_plain(value).map(Some)
    }
}

/// A tuple.
impl<T: Plain> Plain for Vec<T> {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let items = self.iter().map(|item| item.to_plain(py));
        let items = items.collect::<PyResult<Vec<_>>>()?;
        Ok(PyTuple::new(py, items)?.into_any())
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        value
            .try_iter()?
            .map(|item| T::from_plain(&item?))
            .collect()
    }
}

/// A tuple of two.
impl<A: Plain, B: Plain> Plain for (A, B) {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let items = [self.0.to_plain(py)?, self.1.to_plain(py)?];
        Ok(PyTuple::new(py, items)?.into_any())
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (a, b): (Bound<'_, PyAny>, Bound<'_, PyAny>) = value.extract()?;
        Ok((A::from_plain(&a)?, B::from_plain(&b)?))
    }
}
