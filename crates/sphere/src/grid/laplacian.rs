//! Laplacian on the sphere: the balance of the gradient's fluxes through the edges.
//!
//! Thesis: eq. (2.16) is the same operator in pinhole coordinates; here it is for every camera.
//!
//! The gradient's component across an edge is a combination of the difference of the two pixels
//! beside it and of the mean slope along the other pixel coordinate: N = alpha d + beta t with d
//! the step between the two rays and t the rays' own slope along the edge. beta is what pixels
//! that are not rectangular on the sphere need (all but the 360-degree image).

use super::lattice::{Axis, Lattice, Pixel, Sides, Value};
use super::{Border, Edge, SphereGrid};
use nalgebra::Vector3;
use sphereflow_core::Result;

/// Below this share of the edge's length the slope along the edge is rounding, not geometry.
const ORTHOGONAL: f64 = 1e-12;

/// Flux of a gradient through an edge: `across * difference + along * slope`.
#[derive(Clone, Copy, Debug)]
pub(super) struct FluxWeights {
    pub across: f64,
    along: f64,
}

impl FluxWeights {
    /// Of an edge without a pixel on both sides.
    pub const NOTHING: Self = Self {
        across: 0.0,
        along: 0.0,
    };

    pub fn new(
        lattice: &Lattice,
        rays: &[Vector3<f64>],
        edge: &Edge,
        axis: Axis,
        (x, y): Pixel,
    ) -> Self {
        let length = edge.normal_length.norm();
        let beside = lattice.beside(axis, x, y);
        let [before, after] = beside.map(|pixel| lattice.index(pixel));
        let normal = edge.normal_length / length;
        let tangent = edge.middle.cross(&normal);
        let step = rays[after] - rays[before];
        let (d1, d2) = (step.dot(&normal), step.dot(&tangent));
        let slope = slope_along(lattice, axis, rays, beside);
        let Some((t1, t2)) = slope.map(|t| (t.dot(&normal), t.dot(&tangent))) else {
            return Self {
                across: length * d1 / (d1 * d1 + d2 * d2),
                along: 0.0,
            };
        };
        let scale = length / (d1 * t2 - d2 * t1);
        let along = -d2 * scale;
        Self {
            across: t2 * scale,
            along: if (along * t2).abs() < ORTHOGONAL * length {
                0.0
            } else {
                along
            },
        }
    }
}

/// Mean slope of `data` beside the edge, along the other pixel coordinate.
fn slope_along<T: Value>(
    lattice: &Lattice,
    axis: Axis,
    data: &[T],
    beside: [Pixel; 2],
) -> Option<T> {
    let other = match axis {
        Axis::X => Axis::Y,
        Axis::Y => Axis::X,
    };
    let [before, after] = beside.map(|(x, y)| lattice.derivative(other, data, x, y));
    match (before, after) {
        (Some(a), Some(b)) => Some((a + b) * 0.5),
        (one, other) => one.or(other),
    }
}

impl SphereGrid {
    /// Laplacian of `field` (one value per pixel, row-major) on the sphere, units of the field per
    /// square radian, with [`Border::Extrapolate`].
    ///
    /// The value is a balance of fluxes, as for [`SphereGrid::divergence`]: it obeys the theorem of
    /// Gauss likewise, and is of second order up to the poles of a 360-degree image. NaN where
    /// the pixel is invalid or a NaN of the field lies among
    /// its eight neighbours (beside a border: among the pixels it is extrapolated from, up to three
    /// inwards).
    ///
    /// # Errors
    /// [`Error::Shape`](sphereflow_core::Error::Shape) where the length is not that of the grid.
    pub fn laplacian(&self, field: &[f64]) -> Result<Vec<f64>> {
        let mut out = vec![0.0; self.rays.len()];
        self.laplacian_into(field, Border::Extrapolate, &mut out)?;
        Ok(out)
    }

    /// [`SphereGrid::laplacian`] into the caller's buffer, without allocation but for one buffer of
    /// the same size where the grid wraps around: its balance takes two passes.
    ///
    /// # Errors
    /// [`Error::Shape`](sphereflow_core::Error::Shape) where a length is not that of the grid.
    pub fn laplacian_into(&self, field: &[f64], border: Border, out: &mut [f64]) -> Result<()> {
        self.check_len("field", field.len())?;
        match &self.whole {
            None => self.balance_into(out, |axis, x, y| {
                self.gradient_flux(axis, field, x, y, border)
            }),
            Some(whole) => self.centred_balance_into(whole, out, |axis, x, y| {
                self.whole_gradient_flux(whole, axis, field, (x, y))
            }),
        }
    }

    /// Flux of the gradient of `field` through an edge of a grid that does not wrap around, towards
    /// larger x or y.
    pub(super) fn gradient_flux(
        &self,
        axis: Axis,
        field: &[f64],
        x: usize,
        y: usize,
        border: Border,
    ) -> f64 {
        match self.table(axis).sides(x, y) {
            Sides::Closed => 0.0,
            Sides::Inner => self.inner_gradient_flux(axis, field, x, y),
            _ if border == Border::ZeroFlux => 0.0,
            Sides::After => self.border_gradient_flux(axis, field, x, y, 1),
            Sides::Before => self.border_gradient_flux(axis, field, x, y, -1),
        }
    }

    fn inner_gradient_flux(&self, axis: Axis, field: &[f64], x: usize, y: usize) -> f64 {
        let weights = self.table(axis).weights(x, y);
        let beside = self.lattice.beside(axis, x, y);
        let [before, after] = beside.map(|pixel| self.lattice.index(pixel));
        let across = weights.across * (field[after] - field[before]);
        if weights.along == 0.0 {
            return across;
        }
        let slope = slope_along(&self.lattice, axis, field, beside);
        across + weights.along * slope.unwrap_or(f64::NAN)
    }

    /// Flux through a border, extrapolated from the edges inwards.
    fn border_gradient_flux(
        &self,
        axis: Axis,
        field: &[f64],
        x: usize,
        y: usize,
        inwards: isize,
    ) -> f64 {
        let inner = |steps: isize| {
            let move_by = |from: usize| from.checked_add_signed(inwards * steps);
            let (x, y) = match axis {
                Axis::X => (move_by(x)?, y),
                Axis::Y => (x, move_by(y)?),
            };
            let there = self.lattice.has_edge(axis, x, y);
            let inner = there && self.table(axis).sides(x, y) == Sides::Inner;
            inner.then(|| self.inner_gradient_flux(axis, field, x, y))
        };
        match (inner(1), inner(2), inner(3)) {
            (Some(one), Some(two), Some(three)) => 3.0 * (one - two) + three,
            (Some(one), Some(two), None) => 2.0 * one - two,
            _ => f64::NAN,
        }
    }
}
