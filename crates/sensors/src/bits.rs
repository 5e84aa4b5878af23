//! Pixels of 10, 11 and 12 bits, packed with the most significant bit first.

/// Unpacks as many pixels as `packed` and `pixels` both hold; returns their number.
///
/// `bits` is 1 to 16; other values unpack nothing.
pub fn unpack(bits: u32, packed: &[u8], pixels: &mut [u16]) -> usize {
    if !(1..=16).contains(&bits) {
        return 0;
    }
    let count = pixels.len().min(packed.len() * 8 / bits as usize);
    let pixels = &mut pixels[..count];
    let done = if bits == 11 {
        unpack_11(packed, pixels)
    } else {
        0
    };
    // groups of 8 pixels are whole bytes, so that the rest begins on a byte
    unpack_any(
        bits,
        &packed[done * bits as usize / 8..],
        &mut pixels[done..],
    );
    count
}

/// Groups of 8 pixels in 11 bytes, each by two loads of 8 bytes; returns the pixels done.
fn unpack_11(packed: &[u8], pixels: &mut [u16]) -> usize {
    let groups = packed.chunks_exact(11).zip(pixels.chunks_exact_mut(8));
    let mut done = 0;
    for (bytes, out) in groups {
        let first = be64(&bytes[..8]); // pixels 0 to 4 are its upper 55 bits
        let last = be64(&bytes[3..]); // pixels 5 to 7 are its lower 33 bits
        for (i, pixel) in out[..5].iter_mut().enumerate() {
            *pixel = (first >> (53 - 11 * i)) as u16 & 0x7ff;
        }
        for (i, pixel) in out[5..].iter_mut().enumerate() {
            *pixel = (last >> (22 - 11 * i)) as u16 & 0x7ff;
        }
        done += 8;
    }
    done
}

fn be64(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .fold(0, |word, byte| word << 8 | u64::from(*byte))
}

fn unpack_any(bits: u32, packed: &[u8], pixels: &mut [u16]) {
    let mask = (1_u32 << bits) - 1;
    let (mut word, mut held) = (0_u32, 0);
    let mut bytes = packed.iter();
    for pixel in pixels {
        while held < bits {
            word = word << 8 | u32::from(bytes.next().copied().unwrap_or(0));
            held += 8;
        }
        held -= bits;
        *pixel = ((word >> held) & mask) as u16;
    }
}

/// The inverse of [`unpack`]: the last byte is filled up with zeros. Bits above `bits` are cut off.
pub fn pack(bits: u32, pixels: &[u16]) -> Vec<u8> {
    if !(1..=16).contains(&bits) {
        return Vec::new();
    }
    let mut packed = Vec::with_capacity((pixels.len() * bits as usize).div_ceil(8));
    let (mut word, mut held) = (0_u32, 0);
    for pixel in pixels {
        word = word << bits | (u32::from(*pixel) & ((1 << bits) - 1));
        held += bits;
        while held >= 8 {
            held -= 8;
            packed.push((word >> held) as u8);
        }
    }
    if held > 0 {
        packed.push((word << (8 - held)) as u8);
    }
    packed
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn unpack_of_known_bytes_takes_the_most_significant_bit_first() {
        let mut pixels = [0; 2];
        assert_eq!(unpack(12, &[0xab, 0xcd, 0xef], &mut pixels), 2);
        assert_eq!(pixels, [0xabc, 0xdef]);
        let mut pixels = [0; 8];
        unpack(11, &[0xff, 0xe0, 0, 0, 0, 0, 0, 0, 0, 0, 1], &mut pixels);
        assert_eq!(pixels, [2047, 0, 0, 0, 0, 0, 0, 1]);
    }

    #[test]
    fn unpack_of_short_data_stops_at_its_last_whole_pixel() {
        let mut pixels = [7; 8];
        assert_eq!(unpack(11, &[0xff; 10], &mut pixels), 7);
        assert_eq!(pixels[7], 7);
        assert_eq!(
            unpack(0, &[1], &mut pixels) + unpack(17, &[1; 9], &mut pixels),
            0
        );
    }

    proptest! {
        #[test]
        fn pack_then_unpack_is_identity(bits in 1_u32..=16, values in prop::collection::vec(any::<u16>(), 0..70)) {
            let mask = ((1_u32 << bits) - 1) as u16;
            let values: Vec<u16> = values.iter().map(|v| v & mask).collect();
            let mut back = vec![0; values.len()];
            prop_assert_eq!(unpack(bits, &pack(bits, &values), &mut back), values.len());
            prop_assert_eq!(back, values);
        }
    }
}
