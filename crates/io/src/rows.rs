//! Text tables: rows of numbers between commas or blanks, `#` comments, and errors with line numbers.

use crate::{Error, Result};
use sphereflow_core::Stamp;
use std::path::Path;

/// The text of a file.
pub(crate) fn read_text(path: &Path) -> Result<String> {
    let bytes = std::fs::read(path).map_err(Error::system(path, "read"))?;
    String::from_utf8(bytes).map_err(|error| {
        let good = error.utf8_error().valid_up_to();
        let newlines = error.as_bytes()[..good].iter().filter(|&&b| b == b'\n');
        Error::line(path, newlines.count() + 1, "text (UTF-8)", "other bytes")
    })
}

/// One line that is neither empty nor a comment.
pub(crate) struct Row<'a> {
    path: &'a Path,
    /// Line number, from 1.
    pub line: usize,
    /// The fields between commas, or between blanks where there is no comma.
    pub fields: Vec<&'a str>,
}

/// The rows of a table.
pub(crate) fn rows<'a>(path: &'a Path, text: &'a str) -> impl Iterator<Item = Row<'a>> {
    text.trim_start_matches('\u{feff}')
        .lines()
        .enumerate()
        .map(|(index, line)| (index + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
        .map(move |(line, content)| Row {
            path,
            line,
            fields: split(content),
        })
}

fn split(line: &str) -> Vec<&str> {
    if !line.contains(',') {
        return line.split_whitespace().collect();
    }
    // A trailing comma ends the row; an empty field elsewhere stays, and fails as a number.
    let line = line.strip_suffix(',').unwrap_or(line);
    line.split(',').map(str::trim).collect()
}

impl Row<'_> {
    /// An error at this row.
    pub fn error(&self, expected: impl ToString, found: impl ToString) -> Error {
        Error::line(self.path, self.line, expected, found)
    }

    /// An error unless there are exactly `count` columns; `meaning` names them.
    pub fn expect_columns(&self, count: usize, meaning: &str) -> Result<()> {
        if self.fields.len() == count {
            return Ok(());
        }
        Err(self.error(
            format!("{count} columns ({meaning})"),
            format!("{} columns", self.fields.len()),
        ))
    }

    /// An error unless there are at least `count` columns; `meaning` names them.
    pub fn expect_at_least(&self, count: usize, meaning: &str) -> Result<()> {
        if self.fields.len() >= count {
            return Ok(());
        }
        Err(self.error(
            format!("at least {count} columns ({meaning})"),
            format!("{} columns", self.fields.len()),
        ))
    }

    /// A field's text; the row's columns must have been counted before.
    pub fn text(&self, column: usize) -> &str {
        self.fields.get(column).copied().unwrap_or("")
    }

    /// A finite number.
    pub fn number(&self, column: usize) -> Result<f64> {
        let text = self.text(column);
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(self.error(
                format!("a finite number in column {}", column + 1),
                format!("`{text}`"),
            )),
        }
    }

    /// `N` finite numbers from `column` on.
    pub fn numbers<const N: usize>(&self, column: usize) -> Result<[f64; N]> {
        let mut values = [0.0; N];
        for (offset, value) in values.iter_mut().enumerate() {
            *value = self.number(column + offset)?;
        }
        Ok(values)
    }

    /// A time in decimal seconds, read without passing a float.
    pub fn stamp_seconds(&self, column: usize) -> Result<Stamp> {
        let text = self.text(column);
        text.parse().map_err(|_| {
            self.error(
                format!("a time in decimal seconds in column {}", column + 1),
                format!("`{text}`"),
            )
        })
    }

    /// A time in integer nanoseconds.
    pub fn stamp_nanoseconds(&self, column: usize) -> Result<Stamp> {
        let text = self.text(column);
        text.parse().map(Stamp::from_ns).map_err(|_| {
            self.error(
                format!("a time in integer nanoseconds in column {}", column + 1),
                format!("`{text}`"),
            )
        })
    }
}
