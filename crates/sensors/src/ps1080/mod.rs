//! The PrimeSense PS1080 (ASUS Xtion Pro, Carmine): its packets, control messages and image formats.

pub(crate) mod camera;
mod command;
mod compressed;
mod depth;
mod frames;
mod image;
mod parameters;

pub use camera::{Camera, CameraFrame, Content};
pub use command::{Opcode, Reply, Version, parse_reply, parse_version, request};
pub use compressed::{compress_depth, compress_yuv, expand_bayer, expand_depth, expand_yuv};
pub(crate) use depth::padding_of;
pub use depth::{DepthFormat, decode_depth};
pub use frames::{BulkSplitter, FrameAssembler, LARGEST_FRAME, RawFrame};
pub use image::{ImageFormat, decode_image};
pub use parameters::{Parameter, Resolution, StreamSettings, start_depth, start_image, stop};

/// Stream number of depth packets.
pub const DEPTH_STREAM: u8 = 0x70;
/// Stream number of image packets.
pub const IMAGE_STREAM: u8 = 0x80;
