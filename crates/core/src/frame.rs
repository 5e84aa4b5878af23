//! One RGB-D frame as it travels from a recording or device to the estimators.

use crate::{DepthMap, ImuSample, MagSample, Plane, RangeMap, Stamp};

/// What was seen at one instant, and what the inertial sensors said since the frame before.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RgbdFrame {
    /// Time of the frame: the depth image's own stamp where it has one.
    pub stamp: Stamp,
    /// Stamp of the colour image where it has one of its own; `None`: that of the frame.
    pub colour_stamp: Option<Stamp>,
    /// 8-bit RGB; `None` where the recording has no colour for this frame.
    pub colour: Option<Plane<[u8; 3]>>,
    /// Depth along the optical axis, metres; `None` where the recording has none for this frame.
    pub depth: Option<DepthMap>,
    /// Range along the ray, metres: what a 360-degree camera has instead of depth, as an optical
    /// axis means nothing to a ray behind the camera.
    pub range: Option<RangeMap>,
    /// Pixels of the depth image to ignore (true: a moving person, the robot's own arm).
    pub mask: Option<Plane<bool>>,
    /// Inertial samples after the previous frame's stamp, up to this one's.
    pub imu: Vec<ImuSample>,
    /// Magnetic samples after the previous frame's stamp, up to this one's.
    pub mag: Vec<MagSample>,
}

impl RgbdFrame {
    /// Luminance of the colour image (ITU-R BT.601 weights), 0 to 255; `None` without colour.
    pub fn grey(&self) -> Option<Plane<f32>> {
        self.colour.as_ref().map(grey)
    }
}

/// Luminance of a colour image (ITU-R BT.601 weights), 0 to 255.
pub fn grey(colour: &Plane<[u8; 3]>) -> Plane<f32> {
    colour.map(|[r, g, b]| 0.299 * f32::from(*r) + 0.587 * f32::from(*g) + 0.114 * f32::from(*b))
}
