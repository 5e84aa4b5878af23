//! Numbers between blanks, wherever the lines break, with the line number for errors.

use crate::{Error, Result};
use std::path::Path;

pub(super) struct Tokens<'a> {
    path: &'a Path,
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
    line: usize,
    rest: std::str::SplitAsciiWhitespace<'a>,
}

impl<'a> Tokens<'a> {
    pub fn new(path: &'a Path, text: &'a str) -> Self {
        Self {
            path,
            lines: text.lines().enumerate(),
            line: 0,
            rest: "".split_ascii_whitespace(),
        }
    }

    /// An error at the present line.
    pub fn error(&self, expected: impl ToString, found: impl ToString) -> Error {
        Error::line(self.path, self.line, expected, found)
    }

    fn next(&mut self, meaning: &str) -> Result<&'a str> {
        loop {
            if let Some(token) = self.rest.next() {
                return Ok(token);
            }
            let Some((index, line)) = self.lines.next() else {
                return Err(self.error(meaning, "the end of the file"));
            };
            self.line = index + 1;
            if !line.trim_start().starts_with('#') {
                self.rest = line.split_ascii_whitespace();
            }
        }
    }

    /// A number that is not negative and has no fraction.
    pub fn count(&mut self, meaning: &str) -> Result<usize> {
        let token = self.next(meaning)?;
        let wrong = |_| self.error(format!("{meaning} (an integer, 0 or more)"), token);
        token.parse().map_err(wrong)
    }

    /// A finite number.
    pub fn number(&mut self, meaning: &str) -> Result<f64> {
        let token = self.next(meaning)?;
        match token.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(self.error(format!("{meaning} (a finite number)"), token)),
        }
    }

    /// `N` finite numbers.
    pub fn numbers<const N: usize>(&mut self, meaning: &str) -> Result<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.number(meaning)?;
        }
        Ok(values)
    }
}
