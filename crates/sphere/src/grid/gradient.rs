//! Gradient on the sphere from derivatives along the two pixel coordinates.
//!
//! Thesis: eq. (1.21) is the same vector in pinhole coordinates; here it is for every camera.
//!
//! The rays' own derivatives along x and y span the tangent plane; the gradient is the tangent
//! vector with the measured slopes along both, g = f_x e^x + f_y e^y with the dual basis. Rays and
//! field are differenced by the same stencils, so the error is that of the stencil: second order,
//! at image borders too (one-sided over three pixels) and across the poles.

use super::SphereGrid;
use super::lattice::{Axis, Lattice};
use nalgebra::Vector3;
use rayon::prelude::*;
use sphereflow_core::{Error, Result};

/// The dual basis of a pixel: gradients of the pixel coordinates x and y, per radian.
#[derive(Clone, Copy, Debug)]
pub(super) struct DualBasis {
    x: Vector3<f64>,
    y: Vector3<f64>,
}

impl DualBasis {
    /// NaN where a derivative is missing or both are parallel.
    pub fn new(lattice: &Lattice, rays: &[Vector3<f64>], x: usize, y: usize) -> Self {
        let eta = rays[y * lattice.width + x];
        let nan = Vector3::repeat(f64::NAN);
        let tangent = |axis| {
            let slope = lattice.derivative(axis, rays, x, y).unwrap_or(nan);
            slope - eta * eta.dot(&slope)
        };
        let (a, b) = (tangent(Axis::X), tangent(Axis::Y));
        let (aa, ab, bb) = (a.dot(&a), a.dot(&b), b.dot(&b));
        let scale = 1.0 / (aa * bb - ab * ab);
        if !scale.is_finite() {
            return Self { x: nan, y: nan };
        }
        Self {
            x: (a * bb - b * ab) * scale,
            y: (b * aa - a * ab) * scale,
        }
    }
}

impl SphereGrid {
    /// Gradient of `field` (one value per pixel, row-major) on the sphere: tangent vectors in the
    /// camera frame, units of the field per radian.
    ///
    /// NaN where the pixel is invalid, where it has no valid neighbour along an axis, and where a
    /// NaN of the field lies in its stencil (itself and the two neighbours along each axis; beside a border
    /// the two next pixels inwards).
    ///
    /// # Errors
    /// [`Error::Shape`] where the length is not that of the grid.
    pub fn gradient(&self, field: &[f64]) -> Result<Vec<Vector3<f64>>> {
        let mut out = vec![Vector3::zeros(); self.rays.len()];
        self.gradient_into(field, &mut out)?;
        Ok(out)
    }

    /// [`SphereGrid::gradient`] into the caller's buffer, without allocation.
    ///
    /// # Errors
    /// [`Error::Shape`] where a length is not that of the grid.
    pub fn gradient_into(&self, field: &[f64], out: &mut [Vector3<f64>]) -> Result<()> {
        self.check_len("field", field.len())?;
        self.check_len("out", out.len())?;
        let width = self.width();
        let rows = out.par_chunks_mut(width).zip(self.dual.par_chunks(width));
        rows.enumerate().for_each(|(y, (out, dual))| {
            for (x, (out, dual)) in out.iter_mut().zip(dual).enumerate() {
                // A central difference does not read the pixel itself, yet where the field is
                // unknown its gradient is too.
                let known = !field[y * width + x].is_nan();
                let slope = |axis| self.lattice.derivative(axis, field, x, y);
                *out = match (slope(Axis::X), slope(Axis::Y)) {
                    (Some(fx), Some(fy)) if known => dual.x * fx + dual.y * fy,
                    _ => Vector3::repeat(f64::NAN),
                };
            }
        });
        Ok(())
    }

    /// One value per pixel is what every operator takes and gives.
    pub(super) fn check_len(&self, argument: &str, found: usize) -> Result<()> {
        let expected = self.rays.len();
        if found == expected {
            return Ok(());
        }
        Err(Error::shape(
            argument,
            format!("{}x{} = {expected} values", self.width(), self.height()),
            format!("{found} values"),
        ))
    }
}
