//! The sums of balance (6.3) over every domain, in one pass over the pixels.
//!
//! The domains' insides are summed pixel by pixel; their contours only where cells meet, each edge
//! once with both signs, so that the number of domains hardly matters.

use super::config::TimeRule;
use super::domains::Domains;
use super::edge::{EdgeElement, Side};
use super::table::EdgeTable;
use nalgebra::{Vector2, Vector6};
use rayon::prelude::*;
use sphereflow_alignment::{Axis, DepthImage};
use sphereflow_sphere::Camera;

/// No such cell: beyond the image's border.
const NO_CELL: usize = usize::MAX;
/// No such pixel.
const NO_PIXEL: u32 = u32::MAX;

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
    line: [u32; 4],
    /// Range over depth along the axis at the edge's middle.
    length: f64,
    /// Outward for the cell before; the factor 3/2 of D^2 is within.
    element: EdgeElement,
}

/// The whole border between two cells.
#[derive(Clone, Debug)]
struct Border {
    /// Before and after, in the direction of +z1 or +z2.
    cells: [usize; 2],
    edges: std::ops::Range<usize>,
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
    borders: Vec<Border>,
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
            borders: Vec::new(),
            columns: vec![0.0; 3 * width * domains.down()],
            cells: Vec::new(),
            domains,
        };
        let (column_of, row_of) = (
            cells_of(&balance.domains.columns),
            cells_of(&balance.domains.rows),
        );
        let across = balance.domains.across();
        for (y, row) in row_of.iter().enumerate() {
            for (x, column) in column_of.iter().enumerate() {
                let (xf, yf) = (x as f64, y as f64);
                let length = length(xf, yf); // NaN where the lens sees nothing
                let area = table.pixel_area(xf, yf) + 0.0 * length;
                balance.area.push(area as f32);
                balance.area_axis.push((area * length.powi(3)) as f32);
                balance.cell_area[row * across + column] += area;
            }
        }
        balance.add_borders(Side::HighZ1, table, length);
        balance.add_borders(Side::HighZ2, table, length);
        balance
    }

    /// The borders between cells side by side (`HighZ1`) or one above the other (`HighZ2`), those of
    /// the image included.
    fn add_borders(&mut self, side: Side, table: &EdgeTable, length: impl Fn(f64, f64) -> f64) {
        let (across, down) = (self.domains.across(), self.domains.down());
        let width = self.width;
        let height = self.area.len() / width;
        let level = side.is_level();
        let (count, lanes) = if level {
            (down, across)
        } else {
            (across, down)
        };
        let size = if level { height } else { width };
        let domains = self.domains.clone();
        let (places, runs) = if level {
            (&domains.rows, &domains.columns)
        } else {
            (&domains.columns, &domains.rows)
        };
        for (i, &place) in places.iter().enumerate() {
            for lane in 0..lanes {
                let cell = |i: usize| match (i < count, level) {
                    (false, _) => NO_CELL,
                    (true, true) => i * across + lane,
                    (true, false) => lane * across + i,
                };
                let start = self.edges.len();
                for t in runs[lane]..runs[lane + 1] {
                    let pixel = |k: usize| {
                        let s = (place + k).checked_sub(2).filter(|&s| s < size);
                        let (x, y) = if level { (Some(t), s) } else { (s, Some(t)) };
                        x.zip(y).map_or(NO_PIXEL, |(x, y)| (y * width + x) as u32)
                    };
                    let (along, at) = (t as f64, place as f64 - 0.5);
                    let (x, y) = if level { (along, at) } else { (at, along) };
                    let mut element = table.pixel_edge(side, x, y);
                    element.normal *= 1.5;
                    self.edges.push(BorderEdge {
                        line: [0, 1, 2, 3].map(pixel),
                        length: length(x, y),
                        element,
                    });
                }
                self.borders.push(Border {
                    cells: [i.checked_sub(1).map_or(NO_CELL, cell), cell(i)],
                    edges: start..self.edges.len(),
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
            TimeRule::Forward => self.add_contours([first]),
            TimeRule::Trapezoid => self.add_contours([first, second]),
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

    /// Adds the contours with the mean of D^3 and of D^2 of the images.
    fn add_contours<const N: usize>(&mut self, images: [&DepthImage<'_>; N]) {
        for border in &self.borders {
            let mut sum = Vector6::zeros();
            for edge in &self.edges[border.edges.clone()] {
                let (mut square, mut cube) = (0.0, 0.0);
                for image in images {
                    let range = match image.axis() {
                        Axis::Optical => edge.length,
                        Axis::Ray => 1.0,
                    } * at_edge(image.metres(), &edge.line);
                    square += range * range;
                    cube += range * range * range;
                }
                let (tangent, normal) = (&edge.element.tangent, &edge.element.normal);
                for k in 0..3 {
                    sum[k] += cube * tangent[k];
                    sum[3 + k] += square * normal[k];
                }
            }
            sum /= N as f64;
            for (cell, sign) in border.cells.into_iter().zip([1.0, -1.0]) {
                if let Some(cell) = self.cells.get_mut(cell) {
                    cell.coefficients += sum * sign;
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

/// What the image holds between the middle two of four pixels in a line, from the mean of their
/// inverses: on a plane seen by a pinhole the inverse depth is linear in the pixels. Where only one
/// of the two is known, the line through it and the pixel behind it goes on to the edge.
fn at_edge(metres: &[f32], line: &[u32; 4]) -> f64 {
    let get = |k: usize| {
        let value = metres.get(line[k] as usize).copied();
        f64::from(value.unwrap_or(f32::NAN))
    };
    let (a, b) = (get(1), get(2));
    let mean = 2.0 * a * b / (a + b);
    if !mean.is_nan() {
        return mean;
    }
    let (near, behind) = if a.is_nan() { (b, get(3)) } else { (a, get(0)) };
    let extended = 1.5 / near - 0.5 / behind;
    if extended > 0.0 { 1.0 / extended } else { near } // also where the pixel behind is unknown
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
