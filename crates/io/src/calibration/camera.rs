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

    /// The same with another camera of the same image size.
    ///
    /// # Errors
    /// [`sphereflow_core::Error::Shape`] where the size is another.
    pub fn with_camera(&self, camera: &Camera) -> CoreResult<Self> {
        let text = |width: usize, height: usize| format!("{width}x{height}");
        if (camera.width(), camera.height()) != (self.width, self.height) {
            let expected = text(self.width, self.height);
            let found = text(camera.width(), camera.height());
            return Err(sphereflow_core::Error::shape("camera", expected, found));
        }
        let named = camera.named_parameters();
        Ok(Self {
            model: camera.model_name().into(),
            parameters: named.iter().map(|&(n, v)| (n.to_string(), v)).collect(),
            ..self.clone()
        })
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
            depth_correction: None,
            time_offset_s: None,
            gravity_in_world_m_s2: None,
            camera_from_imu: None,
            imu_noise: None,
        }
    }
}
