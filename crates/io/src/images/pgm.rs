//! Binary PGM (P5): 8 bits, or 16 bits with the high byte first (or plainly last).
//! Samples are never rescaled, which is why no general decoder is used: counts of depth must stay
//! counts.

use super::Image;
use crate::{Error, Result};
use sphereflow_core::Plane;
use std::path::Path;

/// Images larger than this are a corrupt header.
const MAX_PIXELS: usize = 1 << 28;

/// From the bytes of a file that begins with `P5`.
pub(super) fn decode(path: &Path, bytes: &[u8]) -> Result<Image> {
    let mut rest = &bytes[2..];
    let mut next = |name: &str| -> Result<usize> {
        let (value, after) = header_number(rest)
            .ok_or_else(|| Error::content(path, format!("a PGM header with {name}"), "none"))?;
        rest = after;
        Ok(value)
    };
    let (width, height, max) = (next("a width")?, next("a height")?, next("a maximum")?);
    let pixels = width
        .checked_mul(height)
        .filter(|&n| n > 0 && n <= MAX_PIXELS);
    let Some(pixels) = pixels else {
        let found = format!("{width}x{height}");
        return Err(Error::content(
            path,
            "a PGM of at least 1x1 and 2^28 pixels",
            found,
        ));
    };
    if max == 0 || max > 65535 {
        return Err(Error::content(path, "a PGM maximum of 1 to 65535", max));
    }
    // Exactly one blank parts header and samples.
    let samples = rest.get(1..).unwrap_or(&[]);
    let expected = if max < 256 { pixels } else { 2 * pixels };
    let Some(samples) = samples.get(..expected) else {
        return Err(Error::content(
            path,
            format!("{expected} bytes of samples for {width}x{height}"),
            format!("{} (truncated)", samples.len()),
        ));
    };
    if max < 256 {
        return Ok(Image::Grey8(Plane::from_vec(
            width,
            height,
            samples.to_vec(),
        )?));
    }
    let pairs = samples.as_chunks::<2>().0;
    let count_of = match is_low_byte_first(pairs) {
        true => u16::from_le_bytes,
        false => u16::from_be_bytes,
    };
    let counts = pairs.iter().map(|&pair| count_of(pair)).collect();
    Ok(Image::Grey16(Plane::from_vec(width, height, counts)?))
}

/// Neighbours differ this many times more in the wrong byte order before it is believed. Depth of
/// real scenes: hundreds of times; noise: once. Larger: fewer images are recognised.
const ROUGHNESS_RATIO: u64 = 8;
/// Distinct values that the second byte of the samples has at least. Larger: flat scenes are missed;
/// smaller: 8-bit grey in the high byte, whose low byte is constant, is turned round.
const MIN_HIGH_BYTES: usize = 3;
/// Fewer samples than this say nothing.
const MIN_SAMPLES: usize = 256;

/// True where the samples are plainly in the order that the format forbids and some recorders write
/// (libfreenect's among them): read as the format says, neighbours jump; the other way round, they
/// are near each other.
fn is_low_byte_first(samples: &[[u8; 2]]) -> bool {
    let roughness = |count_of: fn([u8; 2]) -> u16| -> u64 {
        let counts = samples.windows(2).map(|w| (count_of(w[0]), count_of(w[1])));
        counts.map(|(a, b)| u64::from(a.abs_diff(b))).sum()
    };
    let mut seen = [false; 256];
    samples
        .iter()
        .for_each(|pair| seen[usize::from(pair[1])] = true);
    let high_bytes = seen.iter().filter(|&&seen| seen).count();
    samples.len() >= MIN_SAMPLES
        && high_bytes >= MIN_HIGH_BYTES
        && roughness(u16::from_be_bytes) > ROUGHNESS_RATIO * roughness(u16::from_le_bytes)
}

/// True where the file is a 16-bit PGM whose low bytes come first.
pub(crate) fn file_is_low_byte_first(bytes: &[u8]) -> bool {
    let Some(mut rest) = bytes.strip_prefix(b"P5") else {
        return false;
    };
    let mut numbers = [0; 3];
    for number in &mut numbers {
        let Some((value, after)) = header_number(rest) else {
            return false;
        };
        (*number, rest) = (value, after);
    }
    numbers[2] > 255 && is_low_byte_first(rest.get(1..).unwrap_or(&[]).as_chunks::<2>().0)
}

/// The next number of a header, after blanks and comments, and what follows it.
fn header_number(mut rest: &[u8]) -> Option<(usize, &[u8])> {
    loop {
        match rest.first()? {
            b'#' => {
                let end = rest.iter().position(|&byte| byte == b'\n')?;
                rest = &rest[end..];
            }
            byte if byte.is_ascii_whitespace() => rest = &rest[1..],
            _ => break,
        }
    }
    let digits = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
    let value = std::str::from_utf8(&rest[..digits]).ok()?.parse().ok()?;
    Some((value, &rest[digits..]))
}

/// Append the file of a grey image; colour has no PGM and appends nothing.
pub(super) fn encode(image: &Image, bytes: &mut Vec<u8>) {
    let (width, height) = image.size();
    match image {
        Image::Grey8(plane) => {
            bytes.extend(format!("P5\n{width} {height}\n255\n").bytes());
            bytes.extend(plane.data());
        }
        Image::Grey16(plane) => {
            bytes.extend(format!("P5\n{width} {height}\n65535\n").bytes());
            bytes.extend(plane.data().iter().flat_map(|v| v.to_be_bytes()));
        }
        Image::Rgb8(_) => {}
    }
}
