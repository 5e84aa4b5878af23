//! A calibration's camera: model name and named parameters to a camera, and back.

use super::Calibration;
use sphereflow_core::{Error as CoreError, Result as CoreResult};
use sphereflow_sphere::Camera;
use sphereflow_sphere::camera::Model;
use std::collections::BTreeMap;

impl Calibration {
    /// The camera.
    ///
    /// # Errors
    /// [`CoreError::Value`] naming the parameter that is missing, unknown or out of range, or the
    /// model that is unknown.
    pub fn camera(&self) -> CoreResult<Camera> {
        let (width, height) = (self.width, self.height);
        match self.model.as_str() {
            "pinhole" => {
                let [fx, fy, cx, cy] = self.named(["fx", "fy", "cx", "cy"])?;
                Camera::pinhole(fx, fy, cx, cy, width, height)
            }
            "equirectangular" => {
                let [] = self.named([])?;
                Camera::equirectangular(width, height)
            }
            other => Err(CoreError::value(
                "model",
                "a known camera model",
                format!("`{other}`"),
            )),
        }
    }

    /// The calibration of a camera with depth images of `depth_scale` counts per metre; nothing
    /// else is known.
    ///
    /// # Errors
    /// [`CoreError::Value`] where `depth_scale` is not positive.
    pub fn of_camera(camera: &Camera, depth_scale: f64) -> CoreResult<Self> {
        crate::images::check_scale(depth_scale)?;
        let (model, named): (_, Vec<(&str, f64)>) = match camera.model() {
            Model::Pinhole(m) => (
                "pinhole",
                vec![("fx", m.fx), ("fy", m.fy), ("cx", m.cx), ("cy", m.cy)],
            ),
            Model::Equirectangular(_) => ("equirectangular", vec![]),
        };
        Ok(Self::of_model(
            model,
            &named,
            (camera.width(), camera.height()),
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
        let parameters: BTreeMap<String, f64> = named
            .iter()
            .map(|&(name, value)| (name.to_string(), value))
            .collect();
        Self {
            model: model.into(),
            width,
            height,
            parameters,
            depth_scale,
            readout_s: None,
            time_offset_s: None,
            gravity_in_world_m_s2: None,
            camera_from_imu: None,
            imu_noise: None,
        }
    }

    /// Exactly the parameters of these names.
    fn named<const N: usize>(&self, names: [&str; N]) -> CoreResult<[f64; N]> {
        let unknown = self
            .parameters
            .keys()
            .find(|key| !names.contains(&key.as_str()));
        if let Some(key) = unknown {
            let expected = format!("one of {names:?} for the {} model", self.model);
            return Err(CoreError::value(
                format!("parameters.{key}"),
                expected,
                "an unknown name",
            ));
        }
        let mut values = [0.0; N];
        for (name, value) in names.iter().zip(&mut values) {
            *value = self.parameters.get(*name).copied().ok_or_else(|| {
                CoreError::value(format!("parameters.{name}"), "a number", "nothing")
            })?;
        }
        Ok(values)
    }
}
