//! The thesis's fish-eye: the distorted radius is an arc tangent of the undistorted one.

use super::Bend;
use super::radial::{to_radius, to_radius_by_e};
use nalgebra::{Matrix2x3, Vector2, Vector3};
use sphereflow_core::{Error, Result};
use std::f64::consts::{FRAC_PI_2, PI};

/// Names of the parameters.
pub(crate) const NAMES: [&str; 3] = ["w", "dx", "dy"];

/// Thesis: eq. (1.6). Thesis: eq. (1.5). `r_d = atan(2 r_u tan(w/2)) / w` along the radius, about a distortion centre
/// (dx, dy) that may differ from the principal point (image plane coordinates).
///
/// Seen is what lies in front (z > 0): distorted radii below pi/(2 w).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fov {
    w: f64,
    /// 2 tan(w/2)
    spread: f64,
    centre: Vector2<f64>,
}

impl Fov {
    /// From `w`, the field of view of the ideal lens in radians, and the distortion centre in
    /// image-plane coordinates.
    ///
    /// # Errors
    /// [`Error::Value`] naming the parameter: `w` not between 0 and pi, a centre not finite.
    pub fn new(w: f64, centre: [f64; 2]) -> Result<Self> {
        if !(w > 0.0 && w < PI) {
            return Err(Error::value("w", "an angle between 0 and pi rad", w));
        }
        for (name, value) in NAMES.into_iter().skip(1).zip(centre) {
            if !value.is_finite() {
                return Err(Error::value(name, "a finite number", value));
            }
        }
        Ok(Self {
            w,
            spread: 2.0 * (0.5 * w).tan(),
            centre: centre.into(),
        })
    }

    /// The field of view of the ideal lens, radians.
    pub fn w(&self) -> f64 {
        self.w
    }

    /// `z` times the vector from the distortion centre to the undistorted point: no division, so
    /// that rays next to 90 degrees keep their digits.
    fn off_centre(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        let e = Vector2::new(point.x, point.y) - self.centre * point.z;
        (point.z > 0.0 && e.norm().is_finite()).then_some(e)
    }
}

impl Bend for Fov {
    fn bend(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        let e = self.off_centre(point)?;
        let radius = (self.spread * e.norm()).atan2(point.z) / self.w;
        Some(self.centre + to_radius(&e, radius, 0.0))
    }

    fn bend_with_jacobian(&self, point: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        let e = self.off_centre(point)?;
        let (rho, z) = (e.norm(), point.z);
        let angle = (self.spread * rho).atan2(z);
        let norm2 = (self.spread * rho).powi(2) + z * z;
        let by_rho = self.spread * z / (norm2 * self.w);
        let by_z = -self.spread / (norm2 * self.w); // of the radius, divided by rho
        let radius = angle / self.w;
        let by_e = to_radius_by_e(&e, radius, by_rho);
        let last = e * by_z - by_e * self.centre;
        let jacobian = Matrix2x3::from_columns(&[
            by_e.column(0).into_owned(),
            by_e.column(1).into_owned(),
            last,
        ]);
        Some((self.centre + to_radius(&e, radius, 0.0), jacobian))
    }

    fn straighten(&self, m: &Vector2<f64>) -> Option<Vector3<f64>> {
        let e = m - self.centre;
        let angle = e.norm() * self.w;
        // Thesis: section 6.3. tan(r w) / (2 tan(w/2)), here times cos(r w).
        let slope = self.w / self.spread;
        let x = to_radius(&e, angle.sin() / self.spread, slope) + self.centre * angle.cos();
        (angle < FRAC_PI_2).then(|| Vector3::new(x.x, x.y, angle.cos()).normalize())
    }

    fn named(&self) -> Vec<(&'static str, f64)> {
        let values = [self.w, self.centre.x, self.centre.y];
        NAMES.into_iter().zip(values).collect()
    }
}
