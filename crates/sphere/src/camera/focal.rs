//! From the image plane to pixels: focal lengths and principal point.

use super::binned_coordinate;
use nalgebra::{Matrix2x3, Vector2};
use sphereflow_core::{Error, Result};

/// Thesis: eq. (1.3). Thesis: eq. (1.4), without skew. `u = fx m1 + cx`, `v = fy m2 + cy`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Focal {
    /// Focal length across, pixels.
    pub fx: f64,
    /// Focal length down, pixels.
    pub fy: f64,
    /// Principal point across, pixels.
    pub cx: f64,
    /// Principal point down, pixels.
    pub cy: f64,
}

impl Focal {
    /// # Errors
    /// [`Error::Value`] naming the parameter that is not finite, or the focal length that is not
    /// positive.
    pub fn new(fx: f64, fy: f64, cx: f64, cy: f64) -> Result<Self> {
        for (name, value) in [("fx", fx), ("fy", fy)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::value(name, "a positive number of pixels", value));
            }
        }
        for (name, value) in [("cx", cx), ("cy", cy)] {
            if !value.is_finite() {
                return Err(Error::value(name, "a finite number of pixels", value));
            }
        }
        Ok(Self { fx, fy, cx, cy })
    }

    /// The pixel of an image-plane point; `None` where it is not a finite number.
    pub(crate) fn pixel(&self, m: &Vector2<f64>) -> Option<Vector2<f64>> {
        let pixel = Vector2::new(self.fx * m.x + self.cx, self.fy * m.y + self.cy);
        (pixel.x.is_finite() && pixel.y.is_finite()).then_some(pixel)
    }

    /// Derivative of the pixel from the derivative of the image-plane point.
    pub(crate) fn scale_rows(&self, m_by_point: &Matrix2x3<f64>) -> Matrix2x3<f64> {
        Matrix2x3::from_rows(&[m_by_point.row(0) * self.fx, m_by_point.row(1) * self.fy])
    }

    /// The image-plane point of a pixel; `None` where it is not a finite number.
    pub(crate) fn plane(&self, pixel: &Vector2<f64>) -> Option<Vector2<f64>> {
        let m = Vector2::new((pixel.x - self.cx) / self.fx, (pixel.y - self.cy) / self.fy);
        (m.x.is_finite() && m.y.is_finite()).then_some(m)
    }

    /// For pixels `factor` times as large.
    pub(crate) fn rescaled(&self, factor: f64) -> Self {
        Self {
            fx: self.fx / factor,
            fy: self.fy / factor,
            cx: binned_coordinate(self.cx, factor),
            cy: binned_coordinate(self.cy, factor),
        }
    }

    /// For an image whose first pixel is the pixel (`x0`, `y0`) of this one.
    pub(crate) fn shifted(&self, x0: f64, y0: f64) -> Self {
        Self {
            cx: self.cx - x0,
            cy: self.cy - y0,
            ..*self
        }
    }

    /// Names and values, as in a calibration file.
    pub(crate) fn named(&self) -> [(&'static str, f64); 4] {
        [
            ("fx", self.fx),
            ("fy", self.fy),
            ("cx", self.cx),
            ("cy", self.cy),
        ]
    }
}
