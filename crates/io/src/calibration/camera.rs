//! A calibration's camera: model name and named parameters to a camera, and back.

use super::Calibration;
use sphereflow_core::Result as CoreResult;
use sphereflow_sphere::Camera;

impl Calibration {
    /// The camera.
    ///
    /// # Errors
    /// [`sphereflow_core::Error::Value`] naming the parameter that is missing, unknown or out of
    /// range, or the model that is unknown.
    pub fn camera(&self) -> CoreResult<Camera> {
        let named: Vec<(&str, f64)> = self
            .parameters
            .iter()
            .map(|(name, &value)| (name.as_str(), value))
            .collect();
        Camera::from_named(&self.model, &named, self.width, self.height)
    }

    /// The calibration of a camera with depth images of `depth_scale` counts per metre; nothing
    /// else is known.
    ///
    /// # Errors
    /// [`sphereflow_core::Error::Value`] where `depth_scale` is not positive.
    pub fn of_camera(camera: &Camera, depth_scale: f64) -> CoreResult<Self> {
        crate::images::check_scale(depth_scale)?;
        let size = (camera.width(), camera.height());
        let named = camera.named_parameters();
        Ok(Self::of_model(
            camera.model_name(),
            &named,
            size,
            depth_scale,
        ))
    }

    /// From parts that are known to be right.
    pub(crate) fn of_model(
        model: &str,
        named: &[(&str, f64)],
        (width, height): (usize, usize),
        depth_scale: f64,
    ) -> Self {
        Self {
            model: model.into(),
            width,
            height,
            parameters: named.iter().map(|&(n, v)| (n.to_string(), v)).collect(),
            depth_scale,
            readout_s: None,
            time_offset_s: None,
            gravity_in_world_m_s2: None,
            camera_from_imu: None,
            imu_noise: None,
        }
    }
}
