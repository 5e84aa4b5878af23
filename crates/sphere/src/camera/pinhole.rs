//! The pinhole camera with skew.

use super::{Projection, binned_coordinate};
use nalgebra::{Matrix2x3, Vector2, Vector3};
use sphereflow_core::{Error, Result};

/// Thesis: eq. (1.4). `u = fx x/z + skew y/z + cx`, `v = fy y/z + cy`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pinhole {
    /// Focal length across, pixels.
    pub fx: f64,
    /// Focal length down, pixels.
    pub fy: f64,
    /// Principal point across, pixels.
    pub cx: f64,
    /// Principal point down, pixels.
    pub cy: f64,
    /// Skew, pixels: zero for a sensor with orthogonal axes.
    pub skew: f64,
}

impl Pinhole {
    /// # Errors
    /// [`Error::Value`] naming the parameter that is not finite, or the focal length that is not
    /// positive.
    pub fn new(fx: f64, fy: f64, cx: f64, cy: f64, skew: f64) -> Result<Self> {
        for (name, value) in [("fx", fx), ("fy", fy)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::value(name, "a positive number of pixels", value));
            }
        }
        for (name, value) in [("cx", cx), ("cy", cy), ("skew", skew)] {
            if !value.is_finite() {
                return Err(Error::value(name, "a finite number of pixels", value));
            }
        }
        Ok(Self {
            fx,
            fy,
            cx,
            cy,
            skew,
        })
    }
}

impl Projection for Pinhole {
    fn project(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        let (a, b) = (point.x / point.z, point.y / point.z);
        let pixel = Vector2::new(self.fx * a + self.skew * b + self.cx, self.fy * b + self.cy);
        (point.z > 0.0 && pixel.x.is_finite() && pixel.y.is_finite()).then_some(pixel)
    }

    fn project_with_jacobian(
        &self,
        point: &Vector3<f64>,
    ) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        let pixel = self.project(point)?;
        let (a, b, w) = (point.x / point.z, point.y / point.z, 1.0 / point.z);
        let jacobian = Matrix2x3::new(
            self.fx * w,
            self.skew * w,
            -(self.fx * a + self.skew * b) * w,
            0.0,
            self.fy * w,
            -self.fy * b * w,
        );
        Some((pixel, jacobian))
    }

    fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        let b = (pixel.y - self.cy) / self.fy;
        let a = (pixel.x - self.cx - self.skew * b) / self.fx;
        (a.is_finite() && b.is_finite()).then(|| Vector3::new(a, b, 1.0).normalize())
    }

    fn rescaled(&self, factor: f64) -> Self {
        Self {
            fx: self.fx / factor,
            fy: self.fy / factor,
            cx: binned_coordinate(self.cx, factor),
            cy: binned_coordinate(self.cy, factor),
            skew: self.skew / factor,
        }
    }
    fn shifted(&self, x0: f64, y0: f64) -> Option<Self> {
        Some(Self {
            cx: self.cx - x0,
            cy: self.cy - y0,
            ..*self
        })
    }

    fn named(&self) -> Vec<(&'static str, f64)> {
        vec![
            ("fx", self.fx),
            ("fy", self.fy),
            ("cx", self.cx),
            ("cy", self.cy),
            ("skew", self.skew),
        ]
    }
}
