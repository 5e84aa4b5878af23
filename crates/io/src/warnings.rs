//! Counted warnings: what was passed over while reading, how often, and the first example.

use std::fmt;

/// Something that is not an error but must not go unsaid.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// What happened, without the particulars: warnings of the same text are counted together.
    pub text: String,
    /// How often.
    pub count: usize,
    /// The particulars of the first time.
    pub first: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.count {
            1 => write!(f, "{} ({})", self.text, self.first),
            n => write!(f, "{}: {n} times (first: {})", self.text, self.first),
        }
    }
}

/// Warnings in the order in which each kind first occurred.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Warnings(Vec<Warning>);

impl Warnings {
    /// Count one occurrence; `first` is only called for the first of its kind.
    pub(crate) fn add<T: Into<String>>(&mut self, text: &str, first: impl FnOnce() -> T) {
        match self.0.iter_mut().find(|known| known.text == text) {
            Some(known) => known.count += 1,
            None => self.0.push(Warning {
                text: text.into(),
                count: 1,
                first: first().into(),
            }),
        }
    }

    /// Take over all warnings of `other`.
    pub(crate) fn extend(&mut self, other: &Warnings) {
        self.0.extend(other.0.iter().cloned());
    }

    /// Take over the warnings about the file `name`.
    pub(crate) fn append(&mut self, name: &str, part: Warnings) {
        self.0.extend(part.0.into_iter().map(|warning| Warning {
            text: format!("{name}: {}", warning.text),
            ..warning
        }));
    }

    /// All of them.
    pub fn as_slice(&self) -> &[Warning] {
        &self.0
    }

    /// True where there is nothing to say.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Occurrences over all kinds.
    pub fn total(&self) -> usize {
        self.0.iter().map(|warning| warning.count).sum()
    }
}
