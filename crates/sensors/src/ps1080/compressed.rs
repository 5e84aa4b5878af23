//! Nibble codes of the PS1080: differences to the value before, high nibble first.
//!
//! Common to all: 0 to 12 is the difference plus 6, 13 is filler, 15 a longer code. Depth: 14 and k
//! repeats the last value k + 1 times; 15 and n from 8 on is a difference of 7 bits plus 64, n below
//! 8 begins a value of 15 bits. Images: 15 is followed by the value in two nibbles.

/// The bytes' nibbles, high ones first.
fn nibbles(data: &[u8]) -> impl Iterator<Item = u8> {
    data.iter().flat_map(|byte| [byte >> 4, byte & 15])
}

/// Depth; `true` where the code held exactly as many pixels. Pixels without code stay as they are.
pub fn expand_depth(data: &[u8], pixels: &mut [u16]) -> bool {
    let mut code = nibbles(data);
    let (mut last, mut at) = (0_u16, 0);
    while let Some(nibble) = code.next() {
        let mut count = 1;
        match nibble {
            0..=12 => last = last.wrapping_add(u16::from(nibble)).wrapping_sub(6),
            13 => continue,
            14 => match code.next() {
                Some(more) => count = usize::from(more) + 1,
                None => return false,
            },
            _ => match long(&mut code, last) {
                Some(value) => last = value,
                None => return false,
            },
        }
        let Some(places) = pixels.get_mut(at..at + count) else {
            return false;
        };
        places.fill(last);
        at += count;
    }
    at == pixels.len()
}

fn long(code: &mut impl Iterator<Item = u8>, last: u16) -> Option<u16> {
    let first = u16::from(code.next()?);
    let second = u16::from(code.next()?);
    if first >= 8 {
        return Some(
            last.wrapping_add((first - 8) << 4 | second)
                .wrapping_sub(64),
        );
    }
    let (third, fourth) = (u16::from(code.next()?), u16::from(code.next()?));
    Some(first << 12 | second << 8 | third << 4 | fourth)
}

/// The inverse of [`expand_depth`], of values below 32768.
pub fn compress_depth(pixels: &[u16]) -> Vec<u8> {
    let (mut code, mut last) = (Vec::new(), 0_i32);
    let mut rest = pixels;
    while let Some((first, after)) = rest.split_first() {
        let value = i32::from(*first);
        let run = rest
            .iter()
            .take(16)
            .take_while(|pixel| i32::from(**pixel) == last)
            .count();
        match value - last {
            0 if run > 1 => {
                code.extend([14, run as u8 - 1]);
                rest = &rest[run..];
                continue;
            }
            d @ -6..=6 => code.push((d + 6) as u8),
            d @ -64..=63 => code.extend([15, ((d + 64) >> 4 | 8) as u8, ((d + 64) & 15) as u8]),
            _ => {
                let parts = [12, 8, 4, 0].map(|shift| (value >> shift & 15) as u8);
                code.push(15);
                code.extend(parts);
            }
        }
        last = value;
        rest = after;
    }
    join(&mut code)
}

fn join(code: &mut Vec<u8>) -> Vec<u8> {
    if !code.len().is_multiple_of(2) {
        code.push(13);
    }
    code.chunks_exact(2)
        .map(|pair| pair[0] << 4 | pair[1])
        .collect()
}

/// Bytes whose predictor, of `predictors`, alternates as `of` says and restarts each `line` bytes.
fn expand(data: &[u8], bytes: &mut [u8], line: usize, of: impl Fn(usize) -> usize) -> bool {
    let mut code = nibbles(data);
    let mut last = [0_u8; 4];
    for (i, byte) in bytes.iter_mut().enumerate() {
        let at = i % line.max(1);
        if at == 0 {
            last = [0; 4];
        }
        let value = match code.find(|nibble| *nibble != 13) {
            Some(15) => match (code.next(), code.next()) {
                (Some(high), Some(low)) => high << 4 | low,
                _ => return false,
            },
            Some(nibble @ 0..=12) => last[of(at)].wrapping_add(nibble).wrapping_sub(6),
            _ => return false,
        };
        last[of(at)] = value;
        *byte = value;
    }
    code.all(|nibble| nibble == 13)
}

/// Predictor of byte `at` of a line: U, Y, V, and the same Y again.
fn yuv_predictor(at: usize) -> usize {
    [0, 1, 2, 1][at % 4]
}

/// YUV 4:2:2 as U Y V Y; `true` where the code held exactly as many bytes.
pub fn expand_yuv(data: &[u8], width: usize, bytes: &mut [u8]) -> bool {
    expand(data, bytes, 2 * width, yuv_predictor)
}

/// A Bayer mosaic; `true` where the code held exactly as many bytes.
pub fn expand_bayer(data: &[u8], width: usize, bytes: &mut [u8]) -> bool {
    expand(data, bytes, width, |at| at % 2)
}

/// The inverse of [`expand_yuv`].
pub fn compress_yuv(bytes: &[u8], width: usize) -> Vec<u8> {
    let (mut code, mut last) = (Vec::new(), [0_i16; 4]);
    for (i, byte) in bytes.iter().enumerate() {
        let at = i % (2 * width).max(1);
        if at == 0 {
            last = [0; 4];
        }
        let difference = i16::from(*byte) - last[yuv_predictor(at)];
        match difference {
            -6..=6 => code.push((difference + 6) as u8),
            _ => code.extend([15, byte >> 4, byte & 15]),
        }
        last[yuv_predictor(at)] = i16::from(*byte);
    }
    join(&mut code)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn depth_code_of_known_nibbles_is_read() {
        // full 0x0320, +1, padding, repeat 3 times, diff of -64, -6
        let mut pixels = [9; 7];
        assert!(expand_depth(
            &[0xf0, 0x32, 0x07, 0xde, 0x2f, 0x80, 0x0d],
            &mut pixels
        ));
        assert_eq!(pixels, [800, 801, 801, 801, 801, 737, 731]);
    }

    #[test]
    fn codes_that_end_early_or_hold_too_much_say_so() {
        let mut pixels = [5; 4];
        assert!(!expand_depth(&[0xf0], &mut pixels));
        assert!(!expand_depth(&[0xef], &mut pixels)); // 16 pixels for 4
        assert!(!expand_yuv(&[0xf1], 2, &mut [0; 4]));
        assert!(!expand_yuv(&[0xe6], 2, &mut [0; 4]));
    }

    proptest! {
        #[test]
        fn depth_compressed_and_expanded_is_the_same(
            steps in prop::collection::vec(prop_oneof![Just(0_i32), -8..8_i32, -80..80_i32, -2047..2047_i32], 0..200)
        ) {
            let mut value = 1000;
            let pixels: Vec<u16> = steps.iter().map(|step| {
                value = (value + step).clamp(0, 2047);
                value as u16
            }).collect();
            let mut back = vec![0; pixels.len()];
            prop_assert!(expand_depth(&compress_depth(&pixels), &mut back));
            prop_assert_eq!(back, pixels);
        }

        #[test]
        fn yuv_compressed_and_expanded_is_the_same(bytes in prop::collection::vec(any::<u8>(), 64)) {
            let mut back = vec![0; 64];
            prop_assert!(expand_yuv(&compress_yuv(&bytes, 8), 8, &mut back));
            prop_assert_eq!(back, bytes);
        }
    }
}
