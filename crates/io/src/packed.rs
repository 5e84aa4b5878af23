//! Files in a form that is not read here, recognised by their first bytes so that errors name it.

use crate::{Error, Result};
use std::path::Path;

/// First bytes, what they begin, and what undoes it.
const KINDS: [(&[u8], &str, &str); 9] = [
    (
        b"\x1f\x8b",
        "a gzip-compressed file",
        "unpack it with gunzip",
    ),
    (b"BZh", "a bzip2-compressed file", "unpack it with bunzip2"),
    (
        b"\xfd7zXZ\0",
        "an xz-compressed file",
        "unpack it with unxz",
    ),
    (
        b"\x28\xb5\x2f\xfd",
        "a zstd-compressed file",
        "unpack it with unzstd",
    ),
    (b"PK\x03\x04", "a zip archive", "unpack it with unzip"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", "unpack it with 7z x"),
    (
        b"SQLite format 3\0",
        "an SQLite file (a ROS 2 bag?)",
        "export it as text or images",
    ),
    (b"#ROSBAG", "a ROS bag", "export it as text or images"),
    (b"\xff\xfe", "UTF-16 text", "save it as UTF-8"),
];
/// Where a tar archive says what it is.
const TAR: (usize, &[u8]) = (257, b"ustar");

/// What the bytes are, and what to do about it, where they are of a kind that must be unpacked.
pub(crate) fn named(bytes: &[u8]) -> Option<String> {
    let known = KINDS.iter().find(|(start, ..)| bytes.starts_with(start));
    if let Some((_, what, remedy)) = known {
        return Some(format!("{what}: {remedy} first"));
    }
    let tar = bytes
        .get(TAR.0..)
        .is_some_and(|rest| rest.starts_with(TAR.1));
    tar.then(|| "a tar archive: unpack it with tar xf first".to_string())
}

/// An error that names the packing, where the bytes are packed.
pub(crate) fn refuse(path: &Path, bytes: &[u8], expected: &str) -> Result<()> {
    match named(bytes) {
        Some(found) => Err(Error::content(path, expected, found)),
        None => Ok(()),
    }
}
