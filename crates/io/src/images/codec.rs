//! Image files to planes and back; the content decides the format when reading, the name's
//! extension when writing.

use super::pgm;
use crate::rows::read_bytes;
use crate::{Error, Result, beside, packed};
use image::codecs::{jpeg::JpegEncoder, png};
use image::{DynamicImage, ExtendedColorType, ImageEncoder, ImageFormat, ImageReader};
use sphereflow_core::Plane;
use std::io::Cursor;
use std::path::Path;

/// JPEG quality of [`write_image`]: that of the TUM recordings' colour.
pub(crate) const JPEG_QUALITY: u8 = 92;

/// An image as its file stores it.
#[derive(Clone, Debug, PartialEq)]
pub enum Image {
    /// 8-bit grey.
    Grey8(Plane<u8>),
    /// 16-bit grey: depth in counts.
    Grey16(Plane<u16>),
    /// 8-bit red, green, blue.
    Rgb8(Plane<[u8; 3]>),
}

impl Image {
    /// `(width, height)`.
    pub fn size(&self) -> (usize, usize) {
        match self {
            Self::Grey8(plane) => plane.size(),
            Self::Grey16(plane) => plane.size(),
            Self::Rgb8(plane) => plane.size(),
        }
    }

    fn kind(&self) -> &'static str {
        match self {
            Self::Grey8(_) => "8-bit grey",
            Self::Grey16(_) => "16-bit grey",
            Self::Rgb8(_) => "8-bit RGB",
        }
    }
}

/// Read a PNG (8-bit grey or RGB, 16-bit grey; alpha is dropped, of 16-bit RGB the high bytes are
/// kept), JPEG or binary PGM.
///
/// # Errors
/// [`Error::System`] where the file cannot be read, [`Error::Content`] where it is no such image,
/// is truncated or corrupt.
pub fn read_image(path: &Path) -> Result<Image> {
    let bytes = read_bytes(path)?;
    packed::refuse(path, &bytes, "a PNG, JPEG or binary PGM image")?;
    if bytes.starts_with(b"P5") {
        return pgm::decode(path, &bytes);
    }
    let reader = ImageReader::new(Cursor::new(&bytes))
        .with_guessed_format()
        .map_err(Error::system(path, "read"))?;
    match reader.format() {
        Some(ImageFormat::Png) => {}
        Some(ImageFormat::Jpeg) => check_jpeg_end(path, &bytes)?,
        _ => {
            let found = match bytes.len() {
                0 => "an empty file",
                _ => "another file",
            };
            return Err(Error::content(
                path,
                "a PNG, JPEG or binary PGM image",
                found,
            ));
        }
    }
    let decoded = reader.decode().map_err(|error| {
        Error::content(path, "a whole image", format!("a corrupt one: {error}"))
    })?;
    planes(path, decoded)
}

/// JPEG decoders fill what is missing with grey and say nothing: an image of which the end is
/// missing must not pass. Within the coded data 0xFF is never followed by 0xD9.
fn check_jpeg_end(path: &Path, bytes: &[u8]) -> Result<()> {
    let last = |marker: u8| bytes.windows(2).rposition(|pair| pair == [0xff, marker]);
    match (last(0xda), last(0xd9)) {
        (Some(scan), Some(end)) if end > scan => Ok(()),
        _ => Err(Error::content(
            path,
            "a whole JPEG image",
            "one without its end (truncated)",
        )),
    }
}

fn planes(path: &Path, decoded: DynamicImage) -> Result<Image> {
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    Ok(match decoded {
        DynamicImage::ImageLuma8(image) => {
            Image::Grey8(Plane::from_vec(width, height, image.into_raw())?)
        }
        DynamicImage::ImageLuma16(image) => {
            Image::Grey16(Plane::from_vec(width, height, image.into_raw())?)
        }
        DynamicImage::ImageLumaA8(_)
        | DynamicImage::ImageRgb8(_)
        | DynamicImage::ImageRgba8(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_) => {
            let bytes = decoded.into_rgb8().into_raw();
            Image::Rgb8(Plane::from_vec(
                width,
                height,
                bytes.as_chunks::<3>().0.to_vec(),
            )?)
        }
        other => {
            let found = format!("{:?}", other.color());
            return Err(Error::content(
                path,
                "8-bit grey or RGB, or 16-bit grey",
                found,
            ));
        }
    })
}

/// Read a colour image; grey becomes equal red, green and blue, of 16 bits the high 8 are kept.
///
/// # Errors
/// As [`read_image`].
pub fn read_colour(path: &Path) -> Result<Plane<[u8; 3]>> {
    match read_image(path)? {
        Image::Rgb8(plane) => Ok(plane),
        Image::Grey8(plane) => Ok(plane.map(|&grey| [grey; 3])),
        Image::Grey16(plane) => Ok(plane.map(|&grey| [(grey >> 8) as u8; 3])),
    }
}

/// Read a depth image in counts, never rescaled.
///
/// # Errors
/// As [`read_image`]; [`Error::Content`] where the image has not 16 bits.
pub fn read_raw_depth(path: &Path) -> Result<Plane<u16>> {
    match read_image(path)? {
        Image::Grey16(plane) => Ok(plane),
        other => Err(Error::content(
            path,
            "a 16-bit grey image (depth)",
            other.kind(),
        )),
    }
}

/// Write an image; the extension (`png`, `jpg`, `jpeg`, `pgm`) decides the format. PNG is
/// compressed fast rather than small. JPEG (quality 92) loses; it takes no 16-bit image, and PGM
/// takes no colour.
///
/// # Errors
/// [`Error::Content`] for an extension or image that does not go, [`Error::System`] where the file
/// cannot be written.
pub fn write_image(path: &Path, image: &Image) -> Result<()> {
    beside::write_bytes(path, &encode(path, image, JPEG_QUALITY)?)
}

/// The bytes of [`write_image`].
pub(crate) fn encode(path: &Path, image: &Image, jpeg_quality: u8) -> Result<Vec<u8>> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
    let extension = extension.to_ascii_lowercase();
    let mut bytes = Vec::with_capacity(image.size().0 * image.size().1);
    let written = match (extension.as_str(), image) {
        ("pgm", Image::Grey8(_) | Image::Grey16(_)) => {
            pgm::encode(image, &mut bytes);
            Ok(())
        }
        ("png", _) => {
            let (compression, filter) = (png::CompressionType::Fast, png::FilterType::Up);
            let encoder = png::PngEncoder::new_with_quality(&mut bytes, compression, filter);
            encode_with(encoder, image)
        }
        ("jpg" | "jpeg", Image::Grey8(_) | Image::Rgb8(_)) => encode_with(
            JpegEncoder::new_with_quality(&mut bytes, jpeg_quality),
            image,
        ),
        ("pgm" | "jpg" | "jpeg", other) => {
            let expected = format!("an image that a .{extension} file can hold");
            return Err(Error::content(path, expected, other.kind()));
        }
        _ => {
            let expected = "a name ending in .png, .jpg, .jpeg or .pgm";
            return Err(Error::content(path, expected, format!("`.{extension}`")));
        }
    };
    written
        .map_err(|error| Error::content(path, "an image that can be encoded", error))
        .map(|()| bytes)
}

fn encode_with(encoder: impl ImageEncoder, image: &Image) -> image::ImageResult<()> {
    let (width, height) = (image.size().0 as u32, image.size().1 as u32);
    match image {
        Image::Grey8(p) => encoder.write_image(p.data(), width, height, ExtendedColorType::L8),
        Image::Rgb8(p) => encoder.write_image(
            p.data().as_flattened(),
            width,
            height,
            ExtendedColorType::Rgb8,
        ),
        Image::Grey16(p) => {
            // The encoder wants the machine's own byte order, and turns it itself.
            let bytes: Vec<u8> = p.data().iter().flat_map(|v| v.to_ne_bytes()).collect();
            encoder.write_image(&bytes, width, height, ExtendedColorType::L16)
        }
    }
}
