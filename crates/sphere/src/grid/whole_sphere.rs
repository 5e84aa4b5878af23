//! Fluxes through the edges of a grid that covers the whole sphere, accurate up to the poles.
//!
//! Between two rows of columns that meet at a point an error of the flux counts as one over the
//! distance from the pole: the two-pixel values, second order elsewhere, leave an error of first
//! order in the rows beside it. Hence two rows more, continued beyond a pole down the opposite
//! meridian, along which a smooth field stays smooth. Differences along the rows need no more: what
//! they miss vanishes towards the pole.

use super::SphereGrid;
use super::edges::EdgeTable;
use super::lattice::{Axis, Value};
use nalgebra::Vector3;

/// The mean over an edge between its ends is the value in the middle and this share of the second
/// difference of its neighbours in line.
const MEAN: f64 = 1.0 / 24.0;

/// What the grid of a complete 360-degree image knows more than others.
#[derive(Clone, Debug)]
pub(super) struct WholeSphere {
    width: usize,
    height: usize,
    /// Weight of the difference of the two rows beside an edge in the slope on the edge, those of
    /// the two next rows having -1/24: as in the slope of fourth order, 27/24, but that the first
    /// harmonic is met exactly.
    slope: f64,
    /// Of each row of edges between rows of pixels, for [`WholeSphere::centring_flux`].
    centring: Vec<f64>,
}

impl WholeSphere {
    /// From the edges between the rows of a grid without invalid pixels.
    pub fn new(width: usize, height: usize, edges_y: &EdgeTable) -> Self {
        let step = std::f64::consts::PI / height as f64;
        let half = 0.5 * step;
        // The mean colatitude of a row is beyond its middle by `shift` times the cotangent.
        let shift = 1.0 - half / half.tan();
        let mean_colatitude = |row: usize| {
            let middle = (row as f64 + 0.5) * step;
            middle + shift / middle.tan()
        };
        let weight = |row: usize| match row {
            0 => 0.0,
            _ if row == height => 0.0,
            _ => {
                let length = edges_y.normal(0, row).norm();
                shift * length / (mean_colatitude(row) - mean_colatitude(row - 1))
            }
        };
        Self {
            width,
            height,
            slope: 27.0 / 24.0 - half.sin().powi(2) / 6.0,
            centring: (0..=height).map(weight).collect(),
        }
    }

    /// Row and, beyond a pole, true.
    fn row(&self, row: isize) -> (usize, bool) {
        let height = self.height as isize;
        let (inside, beyond) = match row {
            _ if row < 0 => (-1 - row, true),
            _ if row >= height => (2 * height - 1 - row, true),
            _ => (row, false),
        };
        (inside as usize, beyond)
    }

    /// The value of column `x` in a row that may lie beyond a pole. Where an odd width has no
    /// opposite column it is interpolated between those beside.
    #[inline(always)]
    fn at(&self, data: &[f64], x: usize, row: isize) -> f64 {
        match self.index(x, row) {
            Some(index) => data[index],
            None => self.beyond_pole(data, x, row),
        }
    }

    /// Index of the pixel, `None` beyond a pole.
    #[inline(always)]
    fn index(&self, x: usize, row: isize) -> Option<usize> {
        let row = usize::try_from(row).ok().filter(|row| *row < self.height);
        row.map(|row| row * self.width + x)
    }

    /// Out of the way of all the rows that need it not.
    #[cold]
    #[inline(never)]
    fn beyond_pole<T: Value>(&self, data: &[T], x: usize, row: isize) -> T {
        let (row, _) = self.row(row);
        let line = &data[row * self.width..][..self.width];
        let opposite = |step: usize| line[(x + self.width / 2 + step) % self.width];
        if self.width.is_multiple_of(2) {
            return opposite(0);
        }
        let (near, far) = (
            opposite(0) + opposite(1),
            opposite(self.width - 1) + opposite(2),
        );
        near * (9.0 / 16.0) - far * (1.0 / 16.0)
    }

    /// What flows through edge `(x, y)` to make centre values of means over the pixels.
    ///
    /// The mean of f over a pixel exceeds its value in the middle by h^2/12 times the cotangent of
    /// the colatitude times f's slope down the column: of first order beside a pole. That is the
    /// balance of a flux -h^2/12 times the slope through the edges between rows. The slope is that
    /// of the means between the mean colatitudes of the rows.
    pub fn centring_flux(&self, means: &[f64], axis: Axis, x: usize, y: usize) -> f64 {
        let weight = self.centring[y];
        if axis == Axis::X || weight == 0.0 {
            return 0.0;
        }
        let after = y * self.width + x;
        let flux = weight * (means[after - self.width] - means[after]);
        if flux.is_finite() { flux } else { 0.0 }
    }
}

impl SphereGrid {
    /// Flux of `field` through an edge, towards larger x or y. Where the two rows more have a NaN
    /// the mean of the pixels beside the edge has to do.
    pub(super) fn whole_flux(
        &self,
        whole: &WholeSphere,
        axis: Axis,
        field: &[Vector3<f64>],
        (x, y): (usize, usize),
    ) -> f64 {
        let normal = self.table(axis).normal(x, y);
        let through = |x, row| match whole.index(x, row) {
            Some(index) => normal.dot(&field[index]),
            None => normal.dot(&whole.beyond_pole(field, x, row)),
        };
        let row = y as isize;
        let (near, wide) = match axis {
            Axis::X => {
                let [(before, _), (after, _)] = self.lattice.beside(axis, x, y);
                let sum = |row| through(before, row) + through(after, row);
                let near = sum(row);
                (
                    near,
                    near + MEAN * (sum(row - 1) - 2.0 * near + sum(row + 1)),
                )
            }
            Axis::Y if y == 0 || y == whole.height => return 0.0,
            Axis::Y => {
                let near = through(x, row - 1) + through(x, row);
                let far = through(x, row - 2) + through(x, row + 1);
                (near, near * (9.0 / 8.0) - far * (1.0 / 8.0))
            }
        };
        0.5 * if wide.is_finite() { wide } else { near }
    }

    /// Flux of the gradient of `field` through an edge, towards larger x or y. Where the two rows
    /// more have a NaN the difference of the pixels beside the edge has to do.
    pub(super) fn whole_gradient_flux(
        &self,
        whole: &WholeSphere,
        axis: Axis,
        field: &[f64],
        (x, y): (usize, usize),
    ) -> f64 {
        let [before, after] = self.lattice.beside(axis, x, y);
        let row = y as isize;
        let (near, wide) = match axis {
            Axis::X => {
                let slope = |row| {
                    let (inside, beyond) = whole.row(row);
                    let step = whole.at(field, after.0, row) - whole.at(field, before.0, row);
                    let across = self.edges_x.weights(x, inside).across;
                    // Beyond the pole longitude grows the other way.
                    if beyond {
                        -across * step
                    } else {
                        across * step
                    }
                };
                let near = slope(row);
                let curvature = slope(row - 1) - 2.0 * near + slope(row + 1);
                (near, near + MEAN * curvature)
            }
            Axis::Y if y == 0 || y == whole.height => return 0.0,
            Axis::Y => {
                let across = self.edges_y.weights(x, y).across;
                let near = field[self.lattice.index(after)] - field[self.lattice.index(before)];
                let far = whole.at(field, x, row + 1) - whole.at(field, x, row - 2);
                (across * near, across * (whole.slope * near - far / 24.0))
            }
        };
        if wide.is_finite() { wide } else { near }
    }
}
