//! Divergence on the sphere as a balance of fluxes through the edges of each pixel.

use super::lattice::{Axis, Pixel, Sides};
use super::whole_sphere::WholeSphere;
use super::{Border, SphereGrid};
use nalgebra::Vector3;
use rayon::prelude::*;
use sphereflow_core::Result;

/// Rows that one task works on; the fluxes between two bands are computed by both.
const BAND: usize = 16;

impl SphereGrid {
    /// Divergence on the sphere of the tangential part of `field` (one vector per pixel,
    /// row-major, camera frame), per radian, with [`Border::Extrapolate`].
    ///
    /// The value is the sum of the fluxes through the edges of the pixel over its solid angle. A
    /// flux is shared by both sides of an edge, so the theorem of Gauss holds to rounding for every
    /// set of pixels. On the edge the field is the mean of both pixels: in pixel
    /// coordinates the error of that mean is smooth, so that the balance is second order, although
    /// pixels are neither equal nor rectangular on the sphere. The edge normal is orthogonal to
    /// every ray of the edge: a radial part of the field counts only within the second order.
    ///
    /// So much is the mean over the pixel, which differs from the value at its centre within the
    /// second order, but for the rows beside the poles of a 360-degree image. There the fluxes read
    /// two rows more (where those are known) and include what takes the mean to the centre, so that
    /// the second order reaches to the poles.
    ///
    /// NaN where the pixel is invalid or one of the values its fluxes read is NaN (its neighbours;
    /// beside a border the two next pixels inwards).
    ///
    /// # Errors
    /// [`Error::Shape`](sphereflow_core::Error::Shape) where the length is not that of the grid.
    pub fn divergence(&self, field: &[Vector3<f64>]) -> Result<Vec<f64>> {
        let mut out = vec![0.0; self.rays.len()];
        self.divergence_into(field, Border::Extrapolate, &mut out)?;
        Ok(out)
    }

    /// [`SphereGrid::divergence`] into the caller's buffer, without allocation but for one buffer
    /// of the same size where the grid wraps around: its balance takes two passes.
    ///
    /// # Errors
    /// [`Error::Shape`](sphereflow_core::Error::Shape) where a length is not that of the grid.
    pub fn divergence_into(
        &self,
        field: &[Vector3<f64>],
        border: Border,
        out: &mut [f64],
    ) -> Result<()> {
        self.check_len("field", field.len())?;
        match &self.whole {
            None => self.balance_into(out, |axis, x, y| self.flux(axis, field, x, y, border)),
            Some(whole) => self.centred_balance_into(whole, out, |axis, x, y| {
                self.whole_flux(whole, axis, field, (x, y))
            }),
        }
    }

    /// The sum of the outward `flux(axis, x, y)` of each pixel over its solid angle.
    pub(super) fn balance_into(
        &self,
        out: &mut [f64],
        flux: impl Fn(Axis, usize, usize) -> f64 + Sync,
    ) -> Result<()> {
        self.check_len("out", out.len())?;
        let (width, band) = (self.width(), BAND * self.width());
        let bands = out.par_chunks_mut(band);
        let bands = bands.zip(self.solid_angle.par_chunks(band));
        bands.enumerate().for_each(|(number, (out, areas))| {
            let first = number * BAND;
            for (x, out) in out[..width].iter_mut().enumerate() {
                *out = -flux(Axis::Y, x, first);
            }
            let rows = areas.len() / width;
            for row in 0..rows {
                // The flux through the lower edges serves this row and the next.
                let (above, below) = out[row * width..].split_at_mut(width);
                let mut left = flux(Axis::X, 0, first + row);
                for (x, out) in above.iter_mut().enumerate() {
                    let right = flux(Axis::X, x + 1, first + row);
                    let bottom = flux(Axis::Y, x, first + row + 1);
                    *out = ((right - left) + (bottom + *out)) / areas[row * width + x];
                    left = right;
                    if let Some(next) = below.get_mut(x) {
                        *next = -bottom;
                    }
                }
            }
        });
        Ok(())
    }

    /// The balance of `flux` and of what makes centre values of its means over the pixels.
    pub(super) fn centred_balance_into(
        &self,
        whole: &WholeSphere,
        out: &mut [f64],
        flux: impl Fn(Axis, usize, usize) -> f64 + Sync,
    ) -> Result<()> {
        self.check_len("out", out.len())?;
        let width = self.width();
        let mut means = vec![0.0; out.len()];
        self.balance_into(&mut means, flux)?;
        let rows = out.par_chunks_mut(width);
        let rows = rows.zip(self.solid_angle.par_chunks(width)).enumerate();
        rows.for_each(|(y, (out, areas))| {
            let flux = |x, y| whole.centring_flux(&means, Axis::Y, x, y);
            for (x, (out, area)) in out.iter_mut().zip(areas).enumerate() {
                *out = means[y * width + x] + (flux(x, y + 1) - flux(x, y)) / area;
            }
        });
        Ok(())
    }

    /// Flux of `field` through an edge of a grid that does not wrap around, towards larger x or y.
    pub(super) fn flux(
        &self,
        axis: Axis,
        field: &[Vector3<f64>],
        x: usize,
        y: usize,
        border: Border,
    ) -> f64 {
        let table = self.table(axis);
        let normal = table.normal(x, y);
        let [before, after] = self.lattice.beside(axis, x, y);
        match table.sides(x, y) {
            Sides::Closed => 0.0,
            Sides::Inner => {
                let at = |pixel| field[self.lattice.index(pixel)];
                0.5 * normal.dot(&(at(before) + at(after)))
            }
            _ if border == Border::ZeroFlux => 0.0,
            Sides::After => normal.dot(&self.border_value(axis, field, after, 1)),
            Sides::Before => normal.dot(&self.border_value(axis, field, before, -1)),
        }
    }

    /// The field on the border beside a pixel, the inside being in direction `inwards`: the
    /// mean of the pixel and of one extrapolated beyond the border. (Not the value extrapolated to
    /// the border itself: the error of a mean of two is what the opposite edge has too, and only
    /// equal errors cancel in the balance.)
    fn border_value(
        &self,
        axis: Axis,
        field: &[Vector3<f64>],
        (x, y): Pixel,
        inwards: isize,
    ) -> Vector3<f64> {
        let inner = |steps| self.lattice.neighbour(axis, x, y, inwards * steps);
        let own = field[self.lattice.index((x, y))];
        match (inner(1), inner(2)) {
            (Some(one), Some(two)) => own * 2.0 - field[one] * 1.5 + field[two] * 0.5,
            (Some(one), None) => own * 1.5 - field[one] * 0.5,
            _ => own,
        }
    }
}
