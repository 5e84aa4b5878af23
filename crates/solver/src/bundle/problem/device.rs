//! Rolling depth cameras as they are stated: times, depth field, row motions, sightings.

use super::BundleProblem;
use crate::Result;
use crate::bundle::device::{Device, DeviceCalibration};
use crate::bundle::ids::index;
#[cfg(test)]
use crate::bundle::intrinsics::Intrinsics;
use crate::bundle::measurement::Measurement;
use crate::bundle::prior::root_information;
use crate::bundle::rows::RowMotion;
use crate::bundle::sighting::{InverseDepth, RowPixel};
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
    /// Where in the depth image it was read, `[x/z, y/z]` of that pixel's ray: where the depth field
    /// is taken.
    pub place: [f64; 2],
}

impl ReadDepth {
    /// Of a row whose time after the pose's is this share of the read-out.
    fn measurement(&self, row: f64) -> Result<Measurement> {
        each(
            positive,
            &[("inv_depth", self.inv_depth), ("sigma", self.sigma)],
        )?;
        let numbers = [
            ("colour_offset_s", self.colour_offset_s),
            ("by_offset", self.by_offset),
        ];
        each(finite, &numbers)?;
        all_finite("place", &self.place)?;
        Ok(Measurement::InverseDepth(InverseDepth {
            value: self.inv_depth - self.by_offset * self.colour_offset_s,
            rate: self.by_offset,
            root: 1.0 / self.sigma,
            row,
            place: self.place,
        }))
    }
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
    /// Where an index is unknown, a number is not finite or not positive, or the covariance is not
    /// positive definite.
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
        let depth = depth.map(|read| read.measurement(row)).transpose()?;
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
