//! What a depth camera's images need besides the lens: times, and the field of its inverse depth.

use crate::Result;
use sphereflow_core::checks::all_finite;
use sphereflow_sphere::DepthCorrection;
use sphereflow_sphere::depth_correction::TERM_COUNT;

/// Terms of the field: those of a depth correction but for the constant, which is the unit of length.
pub(crate) const TERMS: usize = TERM_COUNT - 1;
/// Entries in their order.
pub(crate) const READOUT: usize = 0;
pub(crate) const OFFSET: usize = 1;
pub(crate) const FIELD: usize = 2;
pub(crate) const ENTRIES: usize = FIELD + TERMS;
/// Their names, as in a calibration.
pub(crate) const NAMES: [&str; ENTRIES] = [
    "readout_s",
    "colour_offset_s",
    "depth_field.relative.z1",
    "depth_field.relative.z2",
    "depth_field.relative.z1_z1",
    "depth_field.relative.z1_z2",
    "depth_field.relative.z2_z2",
    "depth_field.relative.r2_z1",
    "depth_field.relative.r2_z2",
    "depth_field.relative.r4",
];

/// Times and depth field of a camera: the unknowns that all images share, besides the lens.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeviceCalibration {
    /// Row `y` of `H` is exposed `((y + 1/2)/H - 1/2) readout_s` after the pose's time, seconds.
    pub readout_s: f64,
    /// Middle of the colour exposure = colour stamp + this, on the clock of the depth, seconds.
    pub colour_offset_s: f64,
    /// Coefficients of `m` in `1/Z_true = (1 + m)/Z_measured`: the terms of
    /// [`sphereflow_sphere::depth_correction::TERM_NAMES`] after the constant.
    pub depth_field: [f64; TERMS],
}

impl DeviceCalibration {
    /// The depth field as a correction of depth images.
    ///
    /// # Errors
    /// Where a coefficient is not finite.
    pub fn depth_correction(&self) -> Result<DepthCorrection> {
        let mut relative = [0.0; TERM_COUNT];
        relative[1..].copy_from_slice(&self.depth_field);
        Ok(DepthCorrection::new(relative, [0.0; TERM_COUNT])?)
    }
}

/// The same as numbers in the order of [`NAMES`].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Device {
    pub values: [f64; ENTRIES],
}

impl Device {
    /// # Errors
    /// Where a number is not finite.
    pub fn new(calibration: &DeviceCalibration) -> Result<Self> {
        let mut values = [0.0; ENTRIES];
        values[READOUT] = calibration.readout_s;
        values[OFFSET] = calibration.colour_offset_s;
        values[FIELD..].copy_from_slice(&calibration.depth_field);
        all_finite("device", &values)?;
        Ok(Self { values })
    }

    pub fn calibration(&self) -> DeviceCalibration {
        DeviceCalibration {
            readout_s: self.readout_s(),
            colour_offset_s: self.offset_s(),
            depth_field: *self.field(),
        }
    }

    #[inline(always)]
    pub fn readout_s(&self) -> f64 {
        self.values[READOUT]
    }

    #[inline(always)]
    pub fn offset_s(&self) -> f64 {
        self.values[OFFSET]
    }

    #[inline(always)]
    pub fn field(&self) -> &[f64; TERMS] {
        let [_, _, field @ ..] = &self.values;
        field
    }
}
