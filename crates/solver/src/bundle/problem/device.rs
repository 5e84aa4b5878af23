//! Rolling depth cameras as they are stated: times, depth field, row motions, sightings.

use super::BundleProblem;
use crate::bundle::device::{Device, DeviceCalibration};
use crate::bundle::ids::index;
#[cfg(test)]
use crate::bundle::intrinsics::Intrinsics;
use crate::bundle::measurement::Measurement;
use crate::bundle::prior::root_information;
use crate::bundle::rows::RowMotion;
use crate::bundle::sighting::{InverseDepth, RowPixel};
use crate::{Error, Result};
use nalgebra::{Matrix2, Vector2};
use sphereflow_core::checks::{all_finite, each, finite, positive};

/// 1/Z of the point that a colour pixel sees, at the time of the pixel's row: depth read where the
/// point was when its depth was measured, and carried to the pixel's time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReadDepth {
    /// 1/Z, 1/m.
    pub inv_depth: f64,
    /// Standard deviation of it, 1/m.
    pub sigma: f64,
    /// The `colour_offset_s` that it was read with, seconds.
    pub colour_offset_s: f64,
    /// Its change with that offset, 1/(m s): 0 where the offset is known.
    pub by_offset: f64,
}

impl BundleProblem {
    /// Times and depth field of a camera: a start where they are estimated
    /// ([`BundleProblem::free_intrinsics`]), known elsewhere. Zero at first.
    ///
    /// # Errors
    /// Where there is no such camera or a number is not finite.
    pub fn set_device(&mut self, camera: usize, calibration: &DeviceCalibration) -> Result<()> {
        index("camera", camera, self.intrinsics.len())?;
        self.intrinsics[camera].device = Device::new(calibration)?;
        Ok(())
    }

    /// Times and depth field of a camera; `None` where there is no such camera.
    pub fn device(&self, camera: usize) -> Option<DeviceCalibration> {
        Some(self.intrinsics.get(camera)?.device.calibration())
    }

    /// A parameter of a camera (of its lens or its device) is known with a standard deviation: it
    /// counts while the parameter is estimated.
    ///
    /// # Errors
    /// Where there is no such camera or parameter, or a number is not finite or not positive.
    pub fn add_camera_prior(
        &mut self,
        camera: usize,
        name: &str,
        value: f64,
        sigma: f64,
    ) -> Result<()> {
        index("camera", camera, self.intrinsics.len())?;
        finite("value", value)?;
        positive("sigma", sigma)?;
        self.intrinsics[camera].know(name, value, sigma)
    }

    /// How the camera moves while the rows of a pose's image are exposed; it stands still at first.
    ///
    /// # Errors
    /// Where there is no such pose or a number is not finite.
    pub fn set_row_motion(&mut self, pose: usize, motion: RowMotion) -> Result<()> {
        index("pose", pose, self.views.len())?;
        motion.check()?;
        self.views[pose].rows = motion;
        Ok(())
    }

    /// `point` is seen from `pose` at `pixel`, whose row is exposed at its own time, with a covariance
    /// in pixels squared; and at a depth, which counts by its own deviation and loss.
    ///
    /// # Errors
    /// Where an index is unknown, a number is not finite or not positive, the covariance is not
    /// positive definite, or depth is read where the camera has no ray ahead.
    pub fn add_sighting(
        &mut self,
        pose: usize,
        point: usize,
        pixel: Vector2<f64>,
        covariance: &Matrix2<f64>,
        depth: Option<ReadDepth>,
    ) -> Result<()> {
        index("pose", pose, self.views.len())?;
        index("point", point, self.points.len())?;
        all_finite("pixel", &pixel)?;
        let root = root_information("covariance", covariance)?;
        let camera = &self.intrinsics[self.views[pose].camera].camera;
        let row = (pixel.y + 0.5) / camera.height() as f64 - 0.5;
        let depth = match depth {
            Some(read) => {
                each(
                    positive,
                    &[("inv_depth", read.inv_depth), ("sigma", read.sigma)],
                )?;
                let times = [
                    ("colour_offset_s", read.colour_offset_s),
                    ("by_offset", read.by_offset),
                ];
                each(finite, &times)?;
                let ahead = camera.unproject(&pixel).filter(|ray| ray.z > 0.0);
                let expected = "a pixel whose ray points ahead";
                let ray = ahead.ok_or_else(|| {
                    Error::value("pixel", expected, format!("{:?}", pixel.as_slice()))
                })?;
                Some(Measurement::InverseDepth(InverseDepth {
                    value: read.inv_depth - read.by_offset * read.colour_offset_s,
                    rate: read.by_offset,
                    root: 1.0 / read.sigma,
                    row,
                    place: [ray.x / ray.z, ray.y / ray.z],
                }))
            }
            None => None,
        };
        self.observe(pose, point, Measurement::Row(RowPixel { pixel, root, row }))?;
        if let Some(depth) = depth {
            self.observe(pose, point, depth)?;
        }
        Ok(())
    }

    #[cfg(test)]
    pub(crate) fn forget_camera_priors(&mut self) {
        self.intrinsics.iter_mut().for_each(Intrinsics::forget);
    }
}
