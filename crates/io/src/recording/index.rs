//! The lists `rgb.txt` and `depth.txt`: a stamp and a file name a row.

use crate::rows::{read_text, rows};
use crate::times::{self, Unit};
use crate::{Result, Warnings};
use sphereflow_core::Stamp;
use std::path::{Path, PathBuf};

/// One row whose file is there.
pub(super) struct Listed {
    pub stamp: Stamp,
    pub path: PathBuf,
}

/// Read `folder/name`. Rows whose stamp does not increase or whose file is missing are left out
/// and counted.
pub(super) fn read(folder: &Path, name: &str, warnings: &mut Warnings) -> Result<Vec<Listed>> {
    let path = folder.join(name);
    let text = read_text(&path)?;
    let mut guesses = Warnings::default();
    let unit = times::unit(&path, &text, 0, Unit::Seconds, &mut guesses);
    warnings.append(name, guesses);
    let mut listed: Vec<Listed> = Vec::new();
    for row in rows(&path, &text) {
        row.expect_columns(2, "timestamp filename")?;
        let stamp = row.stamp(0, unit)?;
        if let Some(last) = listed.last()
            && stamp <= last.stamp
        {
            let what = if stamp == last.stamp {
                "a repeated"
            } else {
                "an unsorted"
            };
            warnings.add(&format!("{name}: row with {what} stamp left out"), || {
                format!("line {}: {stamp} s after {} s", row.line, last.stamp)
            });
            continue;
        }
        let file = folder.join(row.text(1));
        if !file.is_file() {
            warnings.add(&format!("{name}: listed file is missing"), || {
                format!("line {}: {}", row.line, row.text(1))
            });
            continue;
        }
        listed.push(Listed { stamp, path: file });
    }
    Ok(listed)
}
