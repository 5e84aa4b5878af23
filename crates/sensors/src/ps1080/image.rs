//! Image formats of the PS1080 to RGB.

use super::compressed::{expand_bayer, expand_yuv};
use crate::colour::{Order, YuvWeights, demosaic, rgb_from_yuv422};
use sphereflow_core::Plane;

/// How images are sent; the numbers are those of the device's format parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub enum ImageFormat {
    /// A Bayer mosaic in nibble code.
    CompressedBayer = 0,
    /// YUV 4:2:2 in nibble code.
    CompressedYuv = 1,
    /// YUV 4:2:2 as U Y V Y.
    Uyvy = 5,
    /// A Bayer mosaic.
    Bayer = 6,
    /// YUV 4:2:2 as Y U Y V.
    Yuyv = 7,
}

/// RGB of a frame's bytes. Pixels whose bytes are missing are those of zeros; the second value says
/// whether the bytes were exactly those of the image. `None` where no image of this size exists in
/// this format.
pub fn decode_image(
    format: ImageFormat,
    (width, height): (usize, usize),
    data: &[u8],
) -> Option<(Plane<[u8; 3]>, bool)> {
    let bytes_per_pixel = match format {
        ImageFormat::CompressedBayer | ImageFormat::Bayer => 1,
        _ => 2,
    };
    let mut raw = vec![0; bytes_per_pixel * width * height];
    let exact = match format {
        ImageFormat::CompressedBayer => expand_bayer(data, width, &mut raw),
        ImageFormat::CompressedYuv => expand_yuv(data, width, &mut raw),
        _ => {
            let count = raw.len().min(data.len());
            raw[..count].copy_from_slice(&data[..count]);
            data.len() == raw.len()
        }
    };
    let yuv = |order| rgb_from_yuv422(width, height, &raw, order, &YuvWeights::PS1080);
    let colour = match format {
        ImageFormat::CompressedBayer | ImageFormat::Bayer => demosaic(width, height, &raw),
        ImageFormat::CompressedYuv | ImageFormat::Uyvy => yuv(Order::Uyvy),
        ImageFormat::Yuyv => yuv(Order::Yuyv),
    };
    colour.ok().map(|colour| (colour, exact))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::colour::{mosaic, yuv422_from_rgb};
    use crate::ps1080::compress_yuv;

    #[test]
    fn image_of_every_format_is_the_same_colour() {
        let colour = Plane::filled(8, 4, [120_u8, 80, 40]);
        let yuv = yuv422_from_rgb(&colour, Order::Uyvy);
        let cases = [
            (ImageFormat::Uyvy, yuv.clone()),
            (ImageFormat::CompressedYuv, compress_yuv(&yuv, 8)),
            (ImageFormat::Yuyv, yuv422_from_rgb(&colour, Order::Yuyv)),
            (ImageFormat::Bayer, mosaic(&colour)),
        ];
        for (format, data) in cases {
            let (image, exact) = decode_image(format, (8, 4), &data).unwrap();
            assert!(exact, "{format:?}");
            for (a, b) in image.data().iter().zip(colour.data()) {
                // two roundings of YUV, amplified by 2
                assert!((0..3).all(|c| a[c].abs_diff(b[c]) <= 3), "{format:?} {a:?}");
            }
            assert!(
                !decode_image(format, (8, 4), &data[..data.len() - 2])
                    .unwrap()
                    .1
            );
        }
        assert!(decode_image(ImageFormat::Uyvy, (7, 4), &[0; 56]).is_none());
    }
}
