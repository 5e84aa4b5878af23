//! The smooth error of a depth camera: a field by which 1/Z is multiplied, the same in every frame.

use super::checks;
use nalgebra::Vector2;
use sphereflow_core::Result;
use sphereflow_sphere::camera::Camera;

/// `1/Z_measured = 1/Z (1 + tilt z1 + quartic r^4)`, with `z1 = x/z`, `z2 = y/z` of the pixel's ray
/// and `r^2 = z1^2 + z2^2`. The defaults are what self-calibration found on two Kinects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseDepthDistortion {
    /// Relative change of 1/Z per unit `z1`.
    pub tilt: f64,
    /// Relative change of 1/Z per `r^4`.
    pub quartic: f64,
}

impl Default for InverseDepthDistortion {
    fn default() -> Self {
        Self {
            tilt: -0.02,
            quartic: -0.05,
        }
    }
}

impl InverseDepthDistortion {
    /// # Errors
    /// Names the coefficient that is not finite.
    pub(crate) fn check(&self) -> Result<()> {
        checks::finite("distortion.tilt", self.tilt)?;
        checks::finite("distortion.quartic", self.quartic)
    }

    /// The factor of 1/Z at `pixel`; NaN where the camera has no ray in front of it.
    pub fn factor(&self, camera: &Camera, pixel: &Vector2<f64>) -> f64 {
        match camera.unproject(pixel) {
            Some(ray) if ray.z > 0.0 => {
                let (z1, z2) = (ray.x / ray.z, ray.y / ray.z);
                let r2 = z1 * z1 + z2 * z2;
                1.0 + self.tilt * z1 + self.quartic * r2 * r2
            }
            _ => f64::NAN,
        }
    }
}

/// The factor of every pixel of one camera, kept until the camera changes.
#[derive(Clone, Debug, Default)]
pub(crate) struct FactorField {
    of: Option<(Camera, InverseDepthDistortion)>,
    factors: Vec<f32>,
}

impl FactorField {
    /// Row-major factors of `camera`'s pixels.
    pub(crate) fn of(&mut self, camera: &Camera, distortion: &InverseDepthDistortion) -> &[f32] {
        let known = matches!(&self.of, Some((c, d)) if c == camera && d == distortion);
        if !known {
            self.factors.clear();
            for y in 0..camera.height() {
                for x in 0..camera.width() {
                    let pixel = Vector2::new(x as f64, y as f64);
                    self.factors.push(distortion.factor(camera, &pixel) as f32);
                }
            }
            self.of = Some((camera.clone(), *distortion));
        }
        &self.factors
    }
}

#[cfg(test)]
impl FactorField {
    pub(crate) fn address(&self) -> *const f32 {
        self.factors.as_ptr()
    }
}
