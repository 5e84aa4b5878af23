//! The sums of balance (6.3) over every domain, in one pass over the pixels.
//!
//! The domains' insides are summed pixel by pixel; their contours only where cells meet, each edge
//! once with both signs, so that the number of domains hardly matters.

use super::config::TimeRule;
use super::domains::Domains;
use super::edge::{EdgeElement, Side};
use super::table::EdgeTable;
use crate::depth_image::{Axis, DepthImage};
use nalgebra::{Vector2, Vector6};
use rayon::prelude::*;
use sphereflow_sphere::Camera;

/// No such pixel or cell: beyond the image's border.
const NONE: usize = usize::MAX;

/// The sums of one cell; NaN where a pixel of it is unknown in either image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CellBalance {
    /// Second minus first image of the integral of D^3, m^3 sr.
    pub(crate) change: f64,
    /// Coefficients of `[omega, v]`.
    pub(crate) coefficients: Vector6<f64>,
    /// Integral of D^3 of the first image, m^3 sr.
    pub(crate) volume: f64,
    /// Solid angle, sr.
    pub(crate) area: f64,
}

/// One pixel's length of the border between two cells, or of the image.
#[derive(Clone, Copy, Debug)]
struct BorderEdge {
    /// Pixels behind, before, after and beyond the edge, in the direction of +z1 or +z2.
    line: [usize; 4],
    /// Cells before and after.
    cells: [usize; 2],
    /// Range over depth along the axis at the edge's middle.
    length: f64,
    /// Outward for the cell before.
    element: EdgeElement,
}

/// Tables of a camera, and room for the sums.
#[derive(Clone, Debug)]
pub(crate) struct Balance {
    width: usize,
    domains: Domains,
    /// Solid angle of each pixel.
    area: Vec<f32>,
    /// Solid angle times the cube of range over depth along the axis.
    area_axis: Vec<f32>,
    cell_area: Vec<f64>,
    edges: Vec<BorderEdge>,
    /// For each row of cells, the columns of the image: change, volume, known pixels.
    columns: Vec<f64>,
    pub(crate) cells: Vec<CellBalance>,
}

impl Balance {
    /// Thesis: section 6.2, section 6.3: the edges and areas of all domains.
    pub(crate) fn new(camera: &Camera, table: &EdgeTable, domains: Domains) -> Self {
        let (width, height) = (camera.width(), camera.height());
        let length = |x: f64, y: f64| range_per_depth(camera, x, y);
        let mut balance = Self {
            width,
            area: Vec::with_capacity(width * height),
            area_axis: Vec::with_capacity(width * height),
            cell_area: vec![0.0; domains.across() * domains.down()],
            edges: Vec::new(),
            columns: vec![0.0; 3 * width * domains.down()],
            cells: Vec::new(),
            domains,
        };
        let (column_of, row_of) = (
            cells_of(&balance.domains.columns),
            cells_of(&balance.domains.rows),
        );
        let across = balance.domains.across();
        for y in 0..height {
            for x in 0..width {
                let (xf, yf) = (x as f64, y as f64);
                let length = length(xf, yf); // NaN where the lens sees nothing
                let area = table.pixel_area(xf, yf) + 0.0 * length;
                balance.area.push(area as f32);
                balance.area_axis.push((area * length.powi(3)) as f32);
                balance.cell_area[row_of[y] * across + column_of[x]] += area;
            }
        }
        balance.add_upright_edges(table, &row_of, length);
        balance.add_level_edges(table, &column_of, length);
        balance
    }

    fn add_upright_edges(
        &mut self,
        table: &EdgeTable,
        row_of: &[usize],
        length: impl Fn(f64, f64) -> f64,
    ) {
        let (width, across) = (self.width, self.domains.across());
        for (i, &x) in self.domains.columns.iter().enumerate() {
            for (y, row) in row_of.iter().enumerate() {
                let cell = |i: usize| if i < across { row * across + i } else { NONE };
                let at = |k: usize| x.checked_add(k).and_then(|x| x.checked_sub(2));
                let pixel = |k: usize| at(k).filter(|&x| x < width).map_or(NONE, |x| y * width + x);
                let middle = (x as f64 - 0.5, y as f64);
                self.edges.push(BorderEdge {
                    line: [0, 1, 2, 3].map(pixel),
                    cells: [i.checked_sub(1).map_or(NONE, cell), cell(i)],
                    length: length(middle.0, middle.1),
                    element: table.pixel_edge(Side::HighZ1, middle.0, middle.1),
                });
            }
        }
    }

    fn add_level_edges(
        &mut self,
        table: &EdgeTable,
        column_of: &[usize],
        length: impl Fn(f64, f64) -> f64,
    ) {
        let (width, across, down) = (self.width, self.domains.across(), self.domains.down());
        let height = self.area.len() / width;
        for (i, &y) in self.domains.rows.iter().enumerate() {
            for (x, column) in column_of.iter().enumerate() {
                let cell = |i: usize| if i < down { i * across + column } else { NONE };
                let at = |k: usize| y.checked_add(k).and_then(|y| y.checked_sub(2));
                let pixel = |k: usize| {
                    at(k)
                        .filter(|&y| y < height)
                        .map_or(NONE, |y| y * width + x)
                };
                let middle = (x as f64, y as f64 - 0.5);
                self.edges.push(BorderEdge {
                    line: [0, 1, 2, 3].map(pixel),
                    cells: [i.checked_sub(1).map_or(NONE, cell), cell(i)],
                    length: length(middle.0, middle.1),
                    element: table.pixel_edge(Side::HighZ2, middle.0, middle.1),
                });
            }
        }
    }

    /// The domains made of the cells.
    pub(crate) fn domains(&self) -> &Domains {
        &self.domains
    }

    /// All sums of all cells. Returns the share of pixels known in both images. Both images are of
    /// the camera's size, along the same axis or not.
    ///
    /// Thesis: eq. (6.3)
    pub(crate) fn accumulate(
        &mut self,
        first: &DepthImage<'_>,
        second: &DepthImage<'_>,
        time: TimeRule,
    ) -> f64 {
        let known = self.add_insides(first, second);
        match time {
            TimeRule::Forward => self.add_contours(first, 1.0),
            TimeRule::Trapezoid => {
                self.add_contours(first, 0.5);
                self.add_contours(second, 0.5);
            }
        }
        known / self.area.len() as f64
    }

    fn volumes(&self, axis: Axis) -> &[f32] {
        match axis {
            Axis::Optical => &self.area_axis,
            Axis::Ray => &self.area,
        }
    }

    /// Sums down the columns of each row of cells, then across the cells; known pixels.
    fn add_insides(&mut self, first: &DepthImage<'_>, second: &DepthImage<'_>) -> f64 {
        let mut columns = std::mem::take(&mut self.columns);
        let (width, rows) = (self.width, &self.domains.rows);
        let weights = [self.volumes(first.axis()), self.volumes(second.axis())];
        let images = [first.metres(), second.metres()];
        columns
            .par_chunks_mut(3 * width)
            .zip(rows.par_windows(2))
            .for_each(|(sums, rows)| {
                sums.fill(0.0);
                for y in rows[0]..rows[1] {
                    let row = y * width..(y + 1) * width;
                    add_row(
                        sums,
                        images.map(|image| &image[row.clone()]),
                        weights.map(|weights| &weights[row.clone()]),
                    );
                }
            });
        self.cells.clear();
        let mut known = 0.0;
        for sums in columns.chunks(3 * width) {
            for bounds in self.domains.columns.windows(2) {
                let total = [0, 1, 2].map(|k| {
                    let cell = k * width + bounds[0]..k * width + bounds[1];
                    sums[cell].iter().sum::<f64>()
                });
                known += total[2];
                self.cells.push(CellBalance {
                    change: total[0],
                    coefficients: Vector6::zeros(),
                    volume: total[1],
                    area: self.cell_area[self.cells.len()],
                });
            }
        }
        self.columns = columns;
        known
    }

    fn add_contours(&mut self, image: &DepthImage<'_>, share: f64) {
        let metres = image.metres();
        let axis = image.axis();
        for edge in &self.edges {
            let length = match axis {
                Axis::Optical => edge.length,
                Axis::Ray => 1.0,
            };
            let range = length / inverse_at_edge(metres, &edge.line);
            let square = share * range * range;
            let tangent = edge.element.tangent * (square * range);
            let normal = edge.element.normal * (1.5 * square);
            let values = Vector6::new(
                tangent.x, tangent.y, tangent.z, normal.x, normal.y, normal.z,
            );
            for (cell, sign) in edge.cells.into_iter().zip([1.0, -1.0]) {
                if let Some(cell) = self.cells.get_mut(cell) {
                    cell.coefficients += values * sign;
                }
            }
        }
    }
}

/// Adds `D^3 d sigma` of one row of both images, column by column, to the columns' changes,
/// volumes and known pixels.
fn add_row(sums: &mut [f64], images: [&[f32]; 2], weights: [&[f32]; 2]) {
    let (change, rest) = sums.split_at_mut(images[0].len());
    let (volume, known) = rest.split_at_mut(images[0].len());
    let sums = change.iter_mut().zip(volume).zip(known);
    let pixels = images[0].iter().zip(images[1]);
    let weights = weights[0].iter().zip(weights[1]);
    for ((((change, volume), known), (&a, &b)), (&wa, &wb)) in sums.zip(pixels).zip(weights) {
        let (before, after) = (cube(a) * f64::from(wa), cube(b) * f64::from(wb));
        *change += after - before;
        *volume += before;
        *known += if (after - before).is_nan() { 0.0 } else { 1.0 };
    }
}

fn cube(metres: f32) -> f64 {
    let metres = f64::from(metres);
    metres * metres * metres
}

/// Inverse of what the image holds, between the middle two of four pixels in a line: on a plane
/// seen by a pinhole the inverse depth is linear in the pixels. Where only one of the two is known,
/// the line through it and the pixel behind it goes on to the edge.
fn inverse_at_edge(metres: &[f32], line: &[usize; 4]) -> f64 {
    let inverse = |k: usize| {
        metres
            .get(line[k])
            .map_or(f64::NAN, |&m| 1.0 / f64::from(m))
    };
    let (a, b) = (inverse(1), inverse(2));
    let (near, behind) = match (a.is_nan(), b.is_nan()) {
        (false, false) => return 0.5 * (a + b),
        (false, true) => (a, inverse(0)),
        (true, false) => (b, inverse(3)),
        (true, true) => return f64::NAN,
    };
    let extended = 1.5 * near - 0.5 * behind;
    if extended > 0.0 { extended } else { near } // also where the pixel behind is unknown
}

/// Range along the ray over depth along the axis; NaN where the lens sees nothing.
fn range_per_depth(camera: &Camera, x: f64, y: f64) -> f64 {
    match camera.unproject(&Vector2::new(x, y)) {
        Some(ray) if ray.z > 0.0 => 1.0 / ray.z,
        _ => f64::NAN,
    }
}

/// The cell of every pixel coordinate.
fn cells_of(bounds: &[usize]) -> Vec<usize> {
    let cells = bounds.windows(2).enumerate();
    cells
        .flat_map(|(cell, ends)| std::iter::repeat_n(cell, ends[1] - ends[0]))
        .collect()
}

#[cfg(test)]
#[path = "balance_tests.rs"]
mod tests;
