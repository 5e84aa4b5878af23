//! Image files: PNG and JPEG through the `image` crate, PGM here; depth in counts and in metres.

mod codec;
mod depth;
mod pgm;

pub use codec::{Image, read_colour, read_image, read_raw_depth, write_image};
pub(crate) use codec::{JPEG_QUALITY, encode};
pub(crate) use depth::{check_scale, raw_from_metres};
pub use depth::{depth_from_raw, range_from_raw, raw_from_depth};
pub(crate) use pgm::file_is_low_byte_first;
