//! Association files: one row a frame, `stamp file stamp file`, instead of two lists (ICL-NUIM and
//! folders that TUM's `associate.py` was run on).

use super::index::Listed;
use crate::rows::{read_text, rows};
use crate::times::{self, Unit};
use crate::{Error, Result, Warnings};
use std::path::{Path, PathBuf};

const COLUMNS: &str = "stamp, file, stamp, file";

/// The first file of the folder, by name, that is named for an association.
pub(super) fn find(folder: &Path) -> Option<PathBuf> {
    let entries = std::fs::read_dir(folder).ok()?.flatten();
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.path())
        .filter(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let name = name.to_ascii_lowercase();
            name.contains("assoc") && name.ends_with(".txt") && path.is_file()
        })
        .collect();
    files.sort();
    files.into_iter().next()
}

/// The depth images and the colour images of the file, each with its own stamp.
///
/// # Errors
/// As the other lists; [`Error::Line`] where nothing says which of two files is depth.
pub(super) fn read(path: &Path, warnings: &mut Warnings) -> Result<(Vec<Listed>, Vec<Listed>)> {
    let text = read_text(path)?;
    let folder = path.parent().unwrap_or(Path::new("."));
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut guesses = Warnings::default();
    let unit = times::unit(path, &text, 0, Unit::Seconds, &mut guesses);
    warnings.append(&name, guesses);
    let (mut depth, mut colour): (Vec<Listed>, Vec<Listed>) = (Vec::new(), Vec::new());
    for row in rows(path, &text) {
        row.expect_columns(4, COLUMNS)?;
        let is_depth = |column: usize| row.text(column).to_ascii_lowercase().contains("depth");
        let (of_depth, of_colour) = match (is_depth(1), is_depth(3)) {
            (true, false) => (0, 2),
            (false, true) => (2, 0),
            _ => return Err(row.error("one file with `depth` in its name", row.fields.join(" "))),
        };
        for (column, list) in [(of_depth, &mut depth), (of_colour, &mut colour)] {
            let stamp = row.stamp(column, unit)?;
            let file = folder.join(row.text(column + 1));
            let late = list.last().is_none_or(|last: &Listed| stamp > last.stamp);
            match (late, file.is_file()) {
                (true, true) => list.push(Listed { stamp, path: file }),
                (true, false) => warnings.add(&format!("{name}: listed file is missing"), || {
                    format!("line {}: {}", row.line, row.text(column + 1))
                }),
                _ => warnings.add(
                    &format!("{name}: stamp that does not increase left out"),
                    || format!("line {}: {stamp} s", row.line),
                ),
            }
        }
    }
    if depth.is_empty() {
        return Err(Error::content(path, "depth images", "none that is there"));
    }
    Ok((depth, colour))
}
