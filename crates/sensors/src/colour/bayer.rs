//! Bayer mosaics with rows G R G R and B G B G (V4L2's SGRBG8), as the Kinect and the PS1080 send them.

use sphereflow_core::{Plane, Result};

/// Bilinear demosaicing: each missing channel is the mean of its nearest measured neighbours, the
/// image mirrored at its borders. Bytes beyond `width * height` are an error, as missing ones are.
///
/// # Errors
/// Where `raw` is not `width * height` bytes, or a side is below 2.
pub fn demosaic(width: usize, height: usize, raw: &[u8]) -> Result<Plane<[u8; 3]>> {
    if width < 2 || height < 2 || raw.len() != width * height {
        return Err(sphereflow_core::Error::shape(
            "raw",
            format!("{width}x{height} bytes, at least 2x2"),
            format!("{} bytes", raw.len()),
        ));
    }
    let mut data = Vec::with_capacity(raw.len());
    for y in 0..height {
        let above = row(raw, width, if y == 0 { 1 } else { y - 1 });
        let here = row(raw, width, y);
        let below = row(raw, width, if y + 1 == height { height - 2 } else { y + 1 });
        for x in 0..width {
            let left = if x == 0 { 1 } else { x - 1 };
            let right = if x + 1 == width { width - 2 } else { x + 1 };
            let across = mean2(here[left], here[right]);
            let along = mean2(above[x], below[x]);
            let cross = mean4(here[left], here[right], above[x], below[x]);
            let diagonal = mean4(above[left], above[right], below[left], below[right]);
            data.push(match (y % 2, x % 2) {
                (0, 0) => [across, here[x], along],
                (0, _) => [here[x], cross, diagonal],
                (_, 0) => [diagonal, cross, here[x]],
                (..) => [along, here[x], across],
            });
        }
    }
    Plane::from_vec(width, height, data)
}

/// What a sensor with this mosaic measures of an RGB image.
pub fn mosaic(colour: &Plane<[u8; 3]>) -> Vec<u8> {
    let (width, height) = colour.size();
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    pixels
        .map(|(x, y)| {
            let [r, g, b] = colour[(x, y)];
            match (y % 2, x % 2) {
                (0, 1) => r,
                (1, 0) => b,
                _ => g,
            }
        })
        .collect()
}

fn row(raw: &[u8], width: usize, y: usize) -> &[u8] {
    &raw[y * width..(y + 1) * width]
}

fn mean2(a: u8, b: u8) -> u8 {
    (u16::from(a) + u16::from(b)).div_ceil(2) as u8
}

fn mean4(a: u8, b: u8, c: u8, d: u8) -> u8 {
    ((u16::from(a) + u16::from(b) + u16::from(c) + u16::from(d) + 2) / 4) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn demosaic_of_one_colour_is_that_colour_everywhere() {
        let colour = Plane::filled(6, 4, [200, 100, 50]);
        assert_eq!(demosaic(6, 4, &mosaic(&colour)).unwrap(), colour);
    }

    #[test]
    fn demosaic_of_a_ramp_is_the_ramp_inside() {
        let colour = Plane::from_fn(16, 8, |x, y| {
            let v = (10 * x + 3 * y) as u8;
            [v, v / 2 * 2, v]
        });
        let back = demosaic(16, 8, &mosaic(&colour)).unwrap();
        for (x, y) in (1..15).flat_map(|x| (1..7).map(move |y| (x, y))) {
            for channel in 0..3 {
                let (a, b) = (colour[(x, y)][channel], back[(x, y)][channel]);
                // a linear ramp is interpolated to the rounding of its values
                assert!(a.abs_diff(b) <= 2, "({x}, {y}) {channel}: {a} {b}");
            }
        }
    }

    #[test]
    fn demosaic_of_a_wrong_size_is_an_error() {
        assert!(demosaic(4, 4, &[0; 15]).is_err());
        assert!(demosaic(1, 4, &[0; 4]).is_err());
    }
}
