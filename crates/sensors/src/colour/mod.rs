//! Raw colour formats to RGB: Bayer mosaics and YUV 4:2:2.

mod bayer;
mod yuv;

pub use bayer::{demosaic, mosaic};
pub use yuv::{Order, YuvWeights, rgb_from_yuv422, yuv422_from_rgb};
