//! Files are written beside their name and renamed when complete: nobody ever reads half of one.

use crate::{Error, Result};
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

const BUFFER_BYTES: usize = 1 << 18;

/// Write a file through `write`, then give it its name. On failure nothing is left behind, and a
/// file that had the name before is untouched.
pub(crate) fn write_file(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<()>,
) -> Result<()> {
    let beside = partial_name(path)?;
    let attempt = (|| {
        let file = File::create(&beside).map_err(Error::system(path, "write"))?;
        let mut buffered = BufWriter::with_capacity(BUFFER_BYTES, file);
        write(&mut buffered)?;
        buffered.flush().map_err(Error::system(path, "write"))?;
        drop(buffered);
        fs::rename(&beside, path).map_err(Error::system(path, "rename into place"))
    })();
    if attempt.is_err() {
        // The error already says what is wrong; a leftover that cannot be removed adds nothing.
        let _ = fs::remove_file(&beside);
    }
    attempt
}

/// [`write_file`] of text or bytes already in memory.
pub(crate) fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    write_file(path, |file| {
        file.write_all(bytes).map_err(Error::system(path, "write"))
    })
}

/// A name of its own in the same folder (rename is atomic only within a file system).
fn partial_name(path: &Path) -> Result<PathBuf> {
    static COUNTER: AtomicU64 = AtomicU64::new(0);
    let name = path
        .file_name()
        .ok_or_else(|| Error::content(path, "the name of a file", "a folder"))?;
    let mut partial = std::ffi::OsString::from(".");
    partial.push(name);
    partial.push(format!(
        ".{}-{}.partial",
        std::process::id(),
        COUNTER.fetch_add(1, Ordering::Relaxed)
    ));
    Ok(path.with_file_name(partial))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn write_that_fails_leaves_old_file_and_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_bytes(&path, b"old").unwrap();
        let failed = write_file(&path, |file| {
            file.write_all(b"new").unwrap();
            Err(Error::content(&path, "success", "failure"))
        });
        assert!(failed.is_err());
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
