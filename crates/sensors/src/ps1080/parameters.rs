//! Parameters of the PS1080 that start and stop its streams.

use super::{DepthFormat, ImageFormat};

/// Parameters by their numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
#[allow(missing_docs)] // the names say it
pub enum Parameter {
    FrameSync = 1,
    HardwareRegistration = 2,
    ImageStream = 5,
    DepthStream = 6,
    ImageFormat = 12,
    ImageResolution = 13,
    ImageRate = 14,
    DepthFormat = 18,
    DepthResolution = 19,
    DepthRate = 20,
    DepthGain = 21,
    DepthHoleFilter = 22,
    DepthMirror = 23,
    DepthDecimation = 24,
    ImageMirror = 71,
}

/// Sizes of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub enum Resolution {
    /// 320x240.
    Qvga = 0,
    /// 640x480.
    Vga = 1,
    /// 1280x1024.
    Sxga = 2,
}

impl Resolution {
    /// Width and height, pixels.
    pub const fn size(&self) -> (usize, usize) {
        match self {
            Self::Qvga => (320, 240),
            Self::Vga => (640, 480),
            Self::Sxga => (1280, 1024),
        }
    }
}

/// What a stream is set to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamSettings<F> {
    /// How pixels are sent.
    pub format: F,
    /// Size of an image.
    pub resolution: Resolution,
    /// Frames per second.
    pub rate_hz: u16,
}

/// Parameters and values that start depth, in order; transfers must wait before.
pub fn start_depth(settings: &StreamSettings<DepthFormat>) -> Vec<(Parameter, u16)> {
    let halved = settings.resolution == Resolution::Qvga && settings.rate_hz < 60;
    vec![
        (Parameter::DepthFormat, settings.format as u16),
        (Parameter::DepthResolution, settings.resolution as u16),
        (Parameter::DepthRate, settings.rate_hz),
        (Parameter::DepthHoleFilter, 0), // it would invent pixels
        (Parameter::DepthDecimation, u16::from(halved)),
        (Parameter::HardwareRegistration, 0),
        (Parameter::DepthMirror, 0),
        (Parameter::DepthStream, 2),
    ]
}

/// Parameters and values that start colour, in order; transfers must wait before.
pub fn start_image(settings: &StreamSettings<ImageFormat>) -> Vec<(Parameter, u16)> {
    vec![
        (Parameter::ImageFormat, settings.format as u16),
        (Parameter::ImageResolution, settings.resolution as u16),
        (Parameter::ImageRate, settings.rate_hz),
        (Parameter::ImageMirror, 0),
        (Parameter::ImageStream, 1),
    ]
}

/// Parameters and values that stop both streams.
pub fn stop() -> Vec<(Parameter, u16)> {
    vec![(Parameter::DepthStream, 0), (Parameter::ImageStream, 0)]
}
