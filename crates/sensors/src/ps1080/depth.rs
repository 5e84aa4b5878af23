//! Depth formats of the PS1080: every one gives raw disparities.

use super::compressed::expand_depth;
use crate::bits::unpack;
use crate::disparity::NO_READING;
use sphereflow_core::Plane;

/// How depth is sent; the numbers are those of the device's format parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub enum DepthFormat {
    /// 16 bits, little-endian.
    Raw16 = 0,
    /// Differences in nibbles.
    Compressed = 1,
    /// 10 bits, packed.
    Packed10 = 2,
    /// 11 bits, packed.
    Packed11 = 3,
    /// 12 bits, packed.
    Packed12 = 4,
}

/// Raw disparities of a frame's bytes; pixels that are missing, at the end or by `padding` (pixels
/// before, pixels after the sent ones), read [`NO_READING`]. The second value says whether the
/// bytes held exactly the pixels that they should.
pub fn decode_depth(
    format: DepthFormat,
    (width, height): (usize, usize),
    padding: (usize, usize),
    data: &[u8],
) -> (Plane<u16>, bool) {
    let mut plane = Plane::filled(width, height, NO_READING);
    let sent = (width * height).checked_sub(padding.0.saturating_add(padding.1));
    let Some(sent) = sent else {
        return (plane, false);
    };
    let pixels = &mut plane.data_mut()[padding.0..padding.0 + sent];
    let exact = match format {
        DepthFormat::Raw16 => {
            let values = data
                .chunks_exact(2)
                .map(|b| u16::from_le_bytes([b[0], b[1]]));
            for (pixel, value) in pixels.iter_mut().zip(values) {
                *pixel = value;
            }
            data.len() == 2 * sent
        }
        DepthFormat::Compressed => expand_depth(data, pixels),
        DepthFormat::Packed10 => packed(10, data, pixels),
        DepthFormat::Packed11 => packed(11, data, pixels),
        DepthFormat::Packed12 => packed(12, data, pixels),
    };
    let none = if format == DepthFormat::Packed10 {
        1023
    } else {
        NO_READING
    };
    for pixel in pixels.iter_mut().filter(|pixel| **pixel >= none) {
        *pixel = NO_READING;
    }
    (plane, exact)
}

fn packed(bits: u32, data: &[u8], pixels: &mut [u16]) -> bool {
    unpack(bits, data, pixels);
    data.len() == (pixels.len() * bits as usize).div_ceil(8)
}

/// Pixels before and after the sent ones that a first packet's ticks say.
pub(crate) fn padding_of(start_ticks: u32) -> (usize, usize) {
    (
        (start_ticks >> 16) as usize,
        (start_ticks & 0xffff) as usize,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bits::pack;
    use crate::ps1080::compress_depth;

    const SIZE: (usize, usize) = (16, 4);

    fn disparities() -> Vec<u16> {
        (0..64_u16)
            .map(|i| {
                if i % 9 == 0 {
                    NO_READING
                } else {
                    700 + i * i % 300
                }
            })
            .collect()
    }

    #[test]
    fn depth_of_every_format_is_the_same() {
        let pixels = disparities();
        let bytes = |format| match format {
            DepthFormat::Raw16 => pixels.iter().flat_map(|p| p.to_le_bytes()).collect(),
            DepthFormat::Compressed => compress_depth(&pixels),
            DepthFormat::Packed11 => pack(11, &pixels),
            _ => pack(12, &pixels),
        };
        use DepthFormat::{Compressed, Packed11, Packed12, Raw16};
        for format in [Raw16, Compressed, Packed11, Packed12] {
            let (plane, exact) = decode_depth(format, SIZE, (0, 0), &bytes(format));
            assert!(exact, "{format:?}");
            assert_eq!(plane.data(), pixels, "{format:?}");
        }
    }

    #[test]
    fn depth_with_padding_is_without_readings_there() {
        let pixels = disparities();
        let data = pack(11, &pixels[..48]);
        let (plane, exact) = decode_depth(DepthFormat::Packed11, SIZE, padding_of(0xa_0006), &data);
        assert!(exact);
        assert_eq!(plane.data()[10..58], pixels[..48]);
        let outside = plane.data()[..10].iter().chain(&plane.data()[58..]);
        assert!(outside.into_iter().all(|pixel| *pixel == NO_READING));
    }

    #[test]
    fn depth_with_missing_bytes_says_so_and_has_no_readings_there() {
        let data = pack(11, &[500; 64]);
        let (plane, exact) = decode_depth(DepthFormat::Packed11, SIZE, (0, 0), &data[..44]);
        assert!(!exact);
        assert_eq!(plane.data()[31..33], [500, NO_READING]);
        assert!(!decode_depth(DepthFormat::Packed11, SIZE, (60, 60), &data).1);
    }
}
