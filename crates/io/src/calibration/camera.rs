//! The cameras of a calibration file: model name and named parameters to a camera, and back; and
//! the file as the calibration that estimators take.

use super::{CalibrationFile, CameraEntry};
use sphereflow_core::{Error, Result};
use sphereflow_sphere::{Calibration, Camera};
use std::collections::BTreeMap;

impl CameraEntry {
    /// Of a camera.
    pub fn of(camera: &Camera) -> Self {
        let size = (camera.width(), camera.height());
        Self::of_model(camera.model_name(), &camera.named_parameters(), size)
    }

    /// The camera.
    ///
    /// # Errors
    /// [`Error::Value`] naming the parameter that is missing, unknown or out of range, or the model
    /// that is unknown.
    pub fn camera(&self) -> Result<Camera> {
        let named: Vec<(&str, f64)> = self
            .parameters
            .iter()
            .map(|(name, &value)| (name.as_str(), value))
            .collect();
        Camera::from_named(&self.model, &named, self.width, self.height)
    }

    fn of_model(model: &str, named: &[(&str, f64)], (width, height): (usize, usize)) -> Self {
        Self {
            model: model.into(),
            width,
            height,
            parameters: named.iter().map(|&(n, v)| (n.to_string(), v)).collect(),
        }
    }
}

impl CalibrationFile {
    /// The depth camera.
    ///
    /// # Errors
    /// As [`CameraEntry::camera`].
    pub fn camera(&self) -> Result<Camera> {
        self.depth.camera()
    }

    /// The calibration of a camera with depth images of `depth_scale` counts per metre; nothing
    /// else is known.
    ///
    /// # Errors
    /// [`Error::Value`] where `depth_scale` is not positive.
    pub fn of_camera(camera: &Camera, depth_scale: f64) -> Result<Self> {
        crate::images::check_scale(depth_scale)?;
        Ok(Self::of_entry(CameraEntry::of(camera), depth_scale))
    }

    /// The same with another depth camera of the same image size.
    ///
    /// # Errors
    /// [`Error::Shape`] where the size is another.
    pub fn with_camera(&self, camera: &Camera) -> Result<Self> {
        let text = |width: usize, height: usize| format!("{width}x{height}");
        let known = (self.depth.width, self.depth.height);
        if (camera.width(), camera.height()) != known {
            let found = text(camera.width(), camera.height());
            return Err(Error::shape("camera", text(known.0, known.1), found));
        }
        Ok(Self {
            depth: CameraEntry::of(camera),
            ..self.clone()
        })
    }

    /// The form in which estimators take it.
    ///
    /// # Errors
    /// As [`CameraEntry::camera`], and as [`Calibration::check`].
    pub fn calibration(&self) -> Result<Calibration> {
        let calibration = Calibration {
            depth: Some(self.depth.camera()?),
            colour: self.colour.as_ref().map(CameraEntry::camera).transpose()?,
            colour_from_depth: self.colour_from_depth,
            camera_from_imu: self.camera_from_imu,
            depth_field: self.depth_field,
            readout_s: self.readout_s,
            colour_offset_s: self.colour_offset_s,
            imu_offset_s: self.imu_offset_s,
            deviations: self.deviations.clone(),
        };
        calibration.check()?;
        Ok(calibration)
    }

    /// The file that holds a calibration, for depth images of `depth_scale` counts per metre.
    ///
    /// # Errors
    /// [`Error::Value`] where it has no depth camera, or `depth_scale` is not positive.
    pub fn of_calibration(calibration: &Calibration, depth_scale: f64) -> Result<Self> {
        let Some(depth) = &calibration.depth else {
            return Err(Error::value("calibration.depth", "a depth camera", "none"));
        };
        let calibration = calibration.clone();
        Ok(Self {
            colour: calibration.colour.as_ref().map(CameraEntry::of),
            colour_from_depth: calibration.colour_from_depth,
            camera_from_imu: calibration.camera_from_imu,
            depth_field: calibration.depth_field,
            readout_s: calibration.readout_s,
            colour_offset_s: calibration.colour_offset_s,
            imu_offset_s: calibration.imu_offset_s,
            deviations: calibration.deviations,
            ..Self::of_camera(depth, depth_scale)?
        })
    }

    /// From parts that are known to be right.
    pub(crate) fn of_model(
        model: &str,
        named: &[(&str, f64)],
        size: (usize, usize),
        depth_scale: f64,
    ) -> Self {
        Self::of_entry(CameraEntry::of_model(model, named, size), depth_scale)
    }

    fn of_entry(depth: CameraEntry, depth_scale: f64) -> Self {
        Self {
            depth,
            colour: None,
            colour_from_depth: None,
            depth_scale,
            readout_s: None,
            colour_offset_s: None,
            imu_offset_s: None,
            depth_field: None,
            gravity_in_world_m_s2: None,
            camera_from_imu: None,
            imu_noise: None,
            deviations: BTreeMap::new(),
        }
    }
}
