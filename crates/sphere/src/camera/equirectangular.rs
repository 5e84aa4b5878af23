//! The whole sphere by longitude and latitude.

use super::Projection;
use nalgebra::{Matrix2x3, Vector2, Vector3};
use sphereflow_core::{Error, Result};
use std::f64::consts::PI;

/// Longitude grows to the right from -pi to pi, zero along +z; latitude grows downwards (y is
/// down) from -pi/2 to pi/2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equirectangular {
    /// Pixels per radian of longitude.
    pub fx: f64,
    /// Pixels per radian of latitude.
    pub fy: f64,
}

impl Equirectangular {
    /// # Errors
    /// [`Error::Value`] for an empty image.
    pub fn new(width: usize, height: usize) -> Result<Self> {
        if width == 0 || height == 0 {
            return Err(Error::value(
                "width, height",
                "at least 1x1",
                format!("{width}x{height}"),
            ));
        }
        Ok(Self {
            fx: width as f64 / (2.0 * PI),
            fy: height as f64 / PI,
        })
    }
}

impl Equirectangular {
    /// Pixels across and down of the whole sphere.
    pub(crate) fn image_size(&self) -> (f64, f64) {
        (self.fx * 2.0 * PI, self.fy * PI)
    }
}

impl Projection for Equirectangular {
    fn project(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        let flat = point.x.hypot(point.z);
        let known = point.iter().all(|v| v.is_finite()) && (flat > 0.0 || point.y != 0.0);
        known.then(|| {
            Vector2::new(
                (point.x.atan2(point.z) + PI) * self.fx - 0.5,
                (point.y.atan2(flat) + 0.5 * PI) * self.fy - 0.5,
            )
        })
    }

    fn project_with_jacobian(
        &self,
        point: &Vector3<f64>,
    ) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        let pixel = self.project(point)?;
        let flat = point.x.hypot(point.z);
        if flat == 0.0 {
            return None; // longitude has no derivative at the poles
        }
        let (flat2, norm2) = (flat * flat, point.norm_squared());
        let lat = self.fy / norm2;
        let jacobian = Matrix2x3::new(
            self.fx * point.z / flat2,
            0.0,
            -self.fx * point.x / flat2,
            -lat * point.y * point.x / flat,
            lat * flat,
            -lat * point.y * point.z / flat,
        );
        Some((pixel, jacobian))
    }

    fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        let longitude = (pixel.x + 0.5) / self.fx - PI;
        let latitude = (pixel.y + 0.5) / self.fy - 0.5 * PI;
        let on_sphere = latitude.abs() <= 0.5 * PI + 1e-12 && longitude.is_finite();
        on_sphere.then(|| {
            Vector3::new(
                latitude.cos() * longitude.sin(),
                latitude.sin(),
                latitude.cos() * longitude.cos(),
            )
        })
    }

    fn rescaled(&self, factor: f64) -> Self {
        Self {
            fx: self.fx / factor,
            fy: self.fy / factor,
        }
    }
    fn shifted(&self, _x0: f64, _y0: f64) -> Option<Self> {
        None // a part of the sphere is not the whole sphere
    }

    fn named(&self) -> Vec<(&'static str, f64)> {
        Vec::new() // the size of the image says it all
    }
}
