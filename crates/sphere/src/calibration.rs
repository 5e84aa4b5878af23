//! What is known of a depth camera, its colour camera and its inertial sensor: geometry, times and
//! the depth's own error.

use crate::{Camera, DepthCorrection};
use sphereflow_core::{Error, Pose, Result, checks};
use std::collections::BTreeMap;

/// Longest read-out of an image that is believed, seconds either way.
const MAX_READOUT_S: f64 = 1.0;

/// The calibration of one device. What is `None` is not known: estimators take the value that their
/// documentation names (no read-out, no offset, an undistorted depth) and say so.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Calibration {
    /// The colour camera.
    pub colour: Option<Camera>,
    /// The depth camera.
    pub depth: Option<Camera>,
    /// Where the depth camera sits in the colour camera's frame; the identity where depth is
    /// registered to colour.
    pub colour_from_depth: Option<Pose>,
    /// Where the inertial sensor sits in the frame of the depth camera.
    pub camera_from_imu: Option<Pose>,
    /// What makes true depth of measured depth.
    pub depth_field: Option<DepthCorrection>,
    /// Rolling shutter: seconds between the exposures of the first and the last row; row `y` of `H`
    /// is exposed `((y + 1/2)/H - 1/2) readout_s` after the stamp. Negative where the last row comes
    /// first.
    pub readout_s: Option<f64>,
    /// Middle of the colour exposure = colour stamp + this, on the clock of the depth stamps, s.
    pub colour_offset_s: Option<f64>,
    /// `imu_time = camera_time + imu_offset_s`.
    pub imu_offset_s: Option<f64>,
    /// Standard deviation of an entry by its name (`readout_s`, `depth_field.relative.z1`, ...), in
    /// the entry's unit.
    pub deviations: BTreeMap<String, f64>,
}

impl Calibration {
    /// Of a device of which only the depth camera is known.
    pub fn of_depth_camera(camera: Camera) -> Self {
        Self {
            depth: Some(camera),
            ..Self::default()
        }
    }

    /// Of a device whose depth images are registered to its colour images.
    pub fn of_registered_camera(camera: Camera) -> Self {
        Self {
            colour: Some(camera.clone()),
            depth: Some(camera),
            colour_from_depth: Some(Pose::identity()),
            ..Self::default()
        }
    }

    /// True where a pixel of the colour image sees what the same pixel of the depth image does.
    pub fn is_registered(&self) -> bool {
        self.colour.is_some()
            && self.colour == self.depth
            && self.colour_from_depth == Some(Pose::identity())
    }

    /// Checks every number.
    ///
    /// # Errors
    /// [`Error::Value`] naming the entry that is out of range.
    pub fn check(&self) -> Result<()> {
        if let Some(readout_s) = self.readout_s
            && !(readout_s.is_finite() && readout_s.abs() < MAX_READOUT_S)
        {
            let expected = "seconds, below 1 either way";
            return Err(Error::value("readout_s", expected, readout_s));
        }
        let offsets = [
            ("colour_offset_s", self.colour_offset_s),
            ("imu_offset_s", self.imu_offset_s),
        ];
        for (name, offset_s) in offsets {
            offset_s.map_or(Ok(()), |offset_s| checks::finite(name, offset_s))?;
        }
        for (name, &deviation) in &self.deviations {
            checks::non_negative(&format!("deviations.{name}"), deviation)?;
        }
        if self.depth_field.is_some() && self.depth.as_ref().is_some_and(Camera::wraps_around) {
            let expected = "a camera with an optical axis: the ranges of a 360-degree camera have no \
                            such correction";
            return Err(Error::value("depth_field", expected, "equirectangular"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera::pinhole(500.0, 500.0, 320.0, 240.0, 640, 480).unwrap()
    }

    #[test]
    fn calibration_is_registered_only_where_both_cameras_are_one() {
        let mut calibration = Calibration::of_registered_camera(camera());
        assert!(calibration.is_registered());
        calibration.colour = Camera::pinhole(510.0, 500.0, 320.0, 240.0, 640, 480).ok();
        assert!(!calibration.is_registered());
        assert!(!Calibration::of_depth_camera(camera()).is_registered());
    }

    #[test]
    fn calibration_out_of_range_names_the_entry() {
        let bad = |change: &dyn Fn(&mut Calibration)| {
            let mut calibration = Calibration::of_depth_camera(camera());
            change(&mut calibration);
            calibration.check().unwrap_err().to_string()
        };
        assert!(bad(&|c| c.readout_s = Some(1.5)).starts_with("readout_s"));
        assert!(bad(&|c| c.imu_offset_s = Some(f64::NAN)).starts_with("imu_offset_s"));
        let negative = bad(&|c| {
            c.deviations.insert("readout_s".into(), -1.0);
        });
        assert!(negative.starts_with("deviations.readout_s"), "{negative}");
    }
}
