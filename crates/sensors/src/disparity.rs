//! Raw disparity to metres with a device's own parameters, for the Kinect v1 and the PS1080.
//!
//! A spot of the pattern seen `m` beside its place on the reference plane lies at
//! `Z = d + m d / (b - m)`, `m = ((raw - 4 c)/4 - 3/8) p`: `b` the baseline from projector to camera,
//! `d` the distance of the reference plane, `p` the size of a pixel there, `c` a constant shift.

use crate::Result;
use sphereflow_core::checks::{each, positive};
use sphereflow_core::{DepthMap, Plane};

/// Disparities from this one up are no reading.
pub const NO_READING: u16 = 2047;

/// Depths from here on are noise rather than measurements, metres (the device's own limit).
const FARTHEST_M: f64 = 10.0;

/// Offset of a disparity's middle, pixels.
const PIXEL_OFFSET: f64 = 0.375;

/// Geometry of a projector with its camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisparityModel {
    /// From the projector to the infrared camera, cm.
    pub baseline_cm: f64,
    /// From the infrared to the colour camera, cm.
    pub colour_baseline_cm: f64,
    /// Distance of the reference plane, cm.
    pub reference_cm: f64,
    /// Size of a pixel on the reference plane, of 1280 in a row, cm.
    pub pixel_cm: f64,
    /// Constant shift, pixels.
    pub shift: u16,
}

impl DisparityModel {
    /// What devices usually say; for recordings that keep disparities without parameters.
    pub const TYPICAL: Self = Self {
        baseline_cm: 7.5,
        colour_baseline_cm: 2.4,
        reference_cm: 120.0,
        pixel_cm: 0.1042,
        shift: 200,
    };

    /// # Errors
    /// Where a length is not positive.
    pub fn check(&self) -> Result<()> {
        let lengths = [
            ("baseline_cm", self.baseline_cm),
            ("colour_baseline_cm", self.colour_baseline_cm),
            ("reference_cm", self.reference_cm),
            ("pixel_cm", self.pixel_cm),
        ];
        Ok(each(positive, &lengths)?)
    }

    /// Depth of a raw disparity, metres, without rounding; `None` of no reading, and of disparities
    /// that no depth below 10 m has: beyond the pole of the formula it is negative.
    pub fn depth_m(&self, raw: u16) -> Option<f64> {
        if raw >= NO_READING {
            return None;
        }
        let pixels = f64::from(raw) / 4.0 - f64::from(self.shift) - PIXEL_OFFSET;
        let m = pixels * self.pixel_cm;
        let depth_m = (m * self.reference_cm / (self.baseline_cm - m) + self.reference_cm) / 100.0;
        (m < self.baseline_cm && depth_m > 0.0 && depth_m < FARTHEST_M).then_some(depth_m)
    }

    /// The raw disparity next to a depth; [`NO_READING`] of a depth that is none or out of range.
    pub fn raw(&self, depth_m: f64) -> u16 {
        if !(depth_m > 0.0 && depth_m < FARTHEST_M) {
            return NO_READING;
        }
        let excess = 100.0 * depth_m - self.reference_cm;
        let m = self.baseline_cm * excess / (excess + self.reference_cm);
        let raw = 4.0 * (m / self.pixel_cm + f64::from(self.shift) + PIXEL_OFFSET);
        if (0.0..f64::from(NO_READING)).contains(&raw) {
            raw.round() as u16
        } else {
            NO_READING
        }
    }

    /// Depths of all disparities, metres, NaN of those without: for whole images.
    pub fn table(&self) -> DisparityTable {
        let depths = (0..=NO_READING).map(|raw| self.depth_m(raw).map_or(f32::NAN, |z| z as f32));
        DisparityTable(depths.collect())
    }

    /// Focal length of the depth camera for a width of 640 pixels that these parameters mean, pixels.
    pub fn focal_length_px(&self) -> f64 {
        self.reference_cm / (2.0 * self.pixel_cm)
    }
}

/// Depths by raw disparity.
#[derive(Clone, Debug)]
pub struct DisparityTable(Vec<f32>);

impl DisparityTable {
    /// Depth of one disparity, metres; NaN without one.
    pub fn depth_m(&self, raw: u16) -> f32 {
        self.0.get(usize::from(raw)).copied().unwrap_or(f32::NAN)
    }

    /// Depths of an image of raw disparities.
    pub fn apply(&self, raw: &Plane<u16>) -> DepthMap {
        DepthMap::new(raw.map(|raw| self.depth_m(*raw)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_are_those_of_an_independent_driver() {
        let table = [
            (400, 501),
            (600, 705),
            (800, 1193),
            (900, 1824),
            (1000, 3864),
            (1050, 8767),
        ];
        for (raw, mm) in table {
            let depth = DisparityModel::TYPICAL.depth_m(raw).unwrap();
            assert_eq!((1000.0 * depth) as u16, mm, "raw {raw}");
        }
    }

    #[test]
    fn depths_beyond_the_pole_are_none() {
        for raw in [1060, 1089, 1090, 1200, 2046, 2047, 5000] {
            assert_eq!(DisparityModel::TYPICAL.depth_m(raw), None, "raw {raw}");
        }
        assert!(DisparityModel::TYPICAL.table().depth_m(2047).is_nan());
    }

    #[test]
    fn raw_of_a_depth_is_its_inverse() {
        let model = DisparityModel::TYPICAL;
        for raw in 300..1055 {
            assert_eq!(model.raw(model.depth_m(raw).unwrap()), raw);
        }
        assert_eq!(model.raw(f64::NAN), NO_READING);
        assert_eq!(model.raw(12.0), NO_READING);
    }

    #[test]
    fn focal_length_of_the_typical_parameters_is_that_of_a_kinect() {
        assert!((DisparityModel::TYPICAL.focal_length_px() - 575.8).abs() < 0.05);
    }
}
