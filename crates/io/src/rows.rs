//! Text tables: rows of numbers between commas or blanks, `#` comments, and errors with line numbers.

use crate::times::Unit;
use crate::{Error, Result, packed};
use sphereflow_core::Stamp;
use std::io::Read;
use std::path::Path;

/// A longer file is no table: an endless device, or something else under its name. Larger: more
/// memory is used before that is said. A trajectory of an hour at 1 kHz has 0.5 GB.
const MAX_BYTES: u64 = 1 << 31;

/// The text of a file.
pub(crate) fn read_text(path: &Path) -> Result<String> {
    let bytes = read_bytes(path)?;
    packed::refuse(path, &bytes, "text")?;
    String::from_utf8(bytes).map_err(|error| {
        let good = error.utf8_error().valid_up_to();
        let newlines = error.as_bytes()[..good].iter().filter(|&&b| b == b'\n');
        Error::line(path, newlines.count() + 1, "text (UTF-8)", "other bytes")
    })
}

/// The bytes of a file that is no longer than any table.
pub(crate) fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    let file = std::fs::File::open(path).map_err(Error::system(path, "read"))?;
    let mut bytes = Vec::new();
    let read = file.take(MAX_BYTES + 1).read_to_end(&mut bytes);
    read.map_err(Error::system(path, "read"))?;
    if bytes.len() as u64 > MAX_BYTES {
        let expected = format!("a file of at most {MAX_BYTES} bytes");
        return Err(Error::content(path, expected, "a longer one"));
    }
    Ok(bytes)
}

/// One line that is neither empty nor a comment.
pub(crate) struct Row<'a> {
    path: &'a Path,
    /// Line number, from 1.
    pub line: usize,
    /// The fields between commas or semicolons, or between blanks where there are none.
    pub fields: Vec<&'a str>,
}

/// The rows of a table. Lines before the first number are a header, with or without `#`.
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
        .skip_while(|row| !row.fields.iter().any(|field| is_number(field)))
}

/// The names of the columns: the last line with letters before the first row, `#` or not.
pub(crate) fn header(text: &str) -> Vec<&str> {
    let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim);
    let names = lines
        .filter(|line| !line.is_empty())
        .take_while(|line| {
            line.starts_with('#') || !split(line).iter().any(|field| is_number(field))
        })
        .last();
    names.map_or(Vec::new(), |line| {
        split(line.trim_start_matches(['#', ' ']))
    })
}

fn is_number(field: &str) -> bool {
    field.parse::<f64>().is_ok() || is_decimal_comma(field)
}

fn split(line: &str) -> Vec<&str> {
    let separator = match () {
        () if line.contains(';') => ';',
        () if line.contains(',') && !has_decimal_commas(line) => ',',
        () => return line.split_whitespace().collect(),
    };
    // A trailing separator ends the row; an empty field elsewhere stays, and fails as a number.
    let line = line.strip_suffix(separator).unwrap_or(line);
    line.split(separator).map(str::trim).collect()
}

/// True where commas stand within numbers that blanks part: at least two fields such as `0,25`.
fn has_decimal_commas(line: &str) -> bool {
    let fields = line.split_whitespace();
    fields.filter(|field| is_decimal_comma(field)).count() >= 2
}

/// A number with a comma for its point, such as `-0,25`.
fn is_decimal_comma(field: &str) -> bool {
    field.split_once(',').is_some_and(|(whole, fraction)| {
        let digit = |text: &str, end: fn(&str) -> Option<char>| {
            end(text).is_some_and(|c| c.is_ascii_digit())
        };
        digit(whole, |text| text.chars().next_back())
            && digit(fraction, |text| text.chars().next())
            && format!("{whole}.{fraction}").parse::<f64>().is_ok()
    })
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
            _ if is_decimal_comma(text) => Err(self.error(
                format!("decimal points in column {}", column + 1),
                format!("`{text}`, a decimal comma"),
            )),
            _ => Err(self.error(
                format!("a finite number in column {}", column + 1),
                format!("`{text}`"),
            )),
        }
    }

    /// True where one of the fields from `column` on is NaN: a sensor's word for "not known".
    pub fn has_nan(&self, column: usize) -> bool {
        let fields = self.fields.get(column..).unwrap_or(&[]);
        fields
            .iter()
            .any(|field| field.parse::<f64>().is_ok_and(f64::is_nan))
    }

    /// `N` finite numbers from `column` on.
    pub fn numbers<const N: usize>(&self, column: usize) -> Result<[f64; N]> {
        let mut values = [0.0; N];
        for (offset, value) in values.iter_mut().enumerate() {
            *value = self.number(column + offset)?;
        }
        Ok(values)
    }

    /// A time in `unit`, read without passing a float.
    pub fn stamp(&self, column: usize, unit: Unit) -> Result<Stamp> {
        let text = self.text(column);
        unit.parse(text).ok_or_else(|| {
            self.error(
                format!("a time in {unit} in column {}", column + 1),
                format!("`{text}`"),
            )
        })
    }

    /// A time in decimal seconds, read without passing a float.
    pub fn stamp_seconds(&self, column: usize) -> Result<Stamp> {
        self.stamp(column, Unit::Seconds)
    }
}
