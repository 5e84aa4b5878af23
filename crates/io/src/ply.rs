//! Coloured point clouds as binary little-endian PLY.

use crate::{Error, Result, beside};
use std::io::Write;
use std::path::Path;

/// A point of a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColouredPoint {
    /// x, y, z in metres.
    pub position_m: [f32; 3],
    /// Red, green, blue.
    pub colour: [u8; 3],
}

/// Bytes of a point: three floats, three bytes.
const POINT_BYTES: usize = 15;
const FORMAT: &str = "ply\nformat binary_little_endian 1.0\n";
const PROPERTIES: &str = "property float x\nproperty float y\nproperty float z\n\
                          property uchar red\nproperty uchar green\nproperty uchar blue\n\
                          end_header\n";

/// Write a cloud; points are taken one by one, so a cloud need not be in memory. `comment` (which
/// frame, which run, ...) becomes `comment` lines of the header.
///
/// # Errors
/// [`Error::Core`] where a coordinate is not finite, [`Error::Content`] where there are not as many
/// points as the iterator said, [`Error::System`] where the file cannot be written.
pub fn write_ply<I>(path: &Path, comment: &str, points: I) -> Result<()>
where
    I: IntoIterator<Item = ColouredPoint>,
    I::IntoIter: ExactSizeIterator,
{
    let points = points.into_iter();
    let count = points.len();
    beside::write_file(path, |file| {
        let mut put = |bytes: &[u8]| file.write_all(bytes).map_err(Error::system(path, "write"));
        put(FORMAT.as_bytes())?;
        for line in comment.lines() {
            put(format!("comment {line}\n").as_bytes())?;
        }
        put(format!("element vertex {count}\n{PROPERTIES}").as_bytes())?;
        let mut written = 0;
        for point in points {
            put(&bytes_of(&point, written)?)?;
            written += 1;
        }
        if written != count {
            return Err(Error::content(path, format!("{count} points"), written));
        }
        Ok(())
    })
}

fn bytes_of(point: &ColouredPoint, index: usize) -> Result<[u8; POINT_BYTES]> {
    if !point.position_m.iter().all(|value| value.is_finite()) {
        let found = format!("{:?} at point {index}", point.position_m);
        return Err(sphereflow_core::Error::value("points", "finite coordinates", found).into());
    }
    let mut bytes = [0; POINT_BYTES];
    for (slot, value) in bytes.chunks_exact_mut(4).zip(point.position_m) {
        slot.copy_from_slice(&value.to_le_bytes());
    }
    bytes[12..].copy_from_slice(&point.colour);
    Ok(bytes)
}

/// Read back a cloud that [`write_ply`] wrote; other layouts of PLY are an error, not a guess.
///
/// # Errors
/// [`Error::Content`] where the header or the number of bytes is another.
pub fn read_ply(path: &Path) -> Result<Vec<ColouredPoint>> {
    let bytes = std::fs::read(path).map_err(Error::system(path, "read"))?;
    let (count, body) = split_header(&bytes).ok_or_else(|| {
        let expected = "a binary little-endian PLY of float x y z, uchar red green blue";
        Error::content(path, expected, "another header")
    })?;
    if Some(body.len()) != count.checked_mul(POINT_BYTES) {
        return Err(Error::content(
            path,
            format!("{count} points of {POINT_BYTES} bytes"),
            format!("{} bytes", body.len()),
        ));
    }
    Ok(body
        .as_chunks::<POINT_BYTES>()
        .0
        .iter()
        .map(point_of)
        .collect())
}

fn point_of(bytes: &[u8; POINT_BYTES]) -> ColouredPoint {
    let float = |k: usize| f32::from_le_bytes(std::array::from_fn(|i| bytes[4 * k + i]));
    ColouredPoint {
        position_m: std::array::from_fn(float),
        colour: std::array::from_fn(|i| bytes[12 + i]),
    }
}

/// The number of points and the bytes after the header.
fn split_header(bytes: &[u8]) -> Option<(usize, &[u8])> {
    let mut rest = bytes.strip_prefix(FORMAT.as_bytes())?;
    let count = loop {
        let end = rest.iter().position(|&byte| byte == b'\n')?;
        let line = std::str::from_utf8(&rest[..end]).ok()?;
        rest = &rest[end + 1..];
        if !line.starts_with("comment") {
            break line.strip_prefix("element vertex ")?.parse().ok()?;
        }
    };
    Some((count, rest.strip_prefix(PROPERTIES.as_bytes())?))
}
