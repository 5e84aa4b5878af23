//! The matrix of a diffusion on the pixel lattice: bilinear-cell differences with the sphere's metric.
//!
//! The energy int |grad u|^2 dsigma is summed over the cells between four pixel centres, with the
//! metric at the cell's middle; pixels are coupled to their eight neighbours, and nothing flows
//! through the border (2.14). The matrix is symmetric and annihilates constants.

use crate::PixelRays;
use rayon::prelude::*;

/// Cells between four pixels: `sqrt(g) g^ij`, [11, 12, 22], zero where a pixel has no ray.
///
/// Thesis: eq. (2.16): in pinhole coordinates these are (1 + z1^2)/n, z1 z2/n and (1 + z2^2)/n.
#[derive(Clone, Debug)]
pub(crate) struct Cells {
    pub width: usize,
    pub height: usize,
    pub wraps: bool,
    /// Cell `(x, y)` lies between columns x and x + 1 and rows y and y + 1; one per pixel, those
    /// beyond the border zero.
    pub metric: Vec<[f64; 3]>,
}

impl Cells {
    pub fn new(rays: &PixelRays) -> Self {
        let (width, height) = rays.size();
        let wraps = rays.wraps_around();
        let density = |i: usize| {
            let [a, b, c] = rays.inverse_metric(i).map(f64::from);
            let root = (a * c - b * b).sqrt();
            [a / root, b / root, c / root]
        };
        let metric = (0..width * height)
            .map(|i| {
                let (x, y) = (i % width, i / width);
                let right = if x + 1 < width { x + 1 } else { 0 };
                if (x + 1 == width && !wraps) || y + 1 == height {
                    return [0.0; 3];
                }
                let corners = [i, y * width + right, i + width, (y + 1) * width + right];
                if corners.iter().any(|c| !rays.is_valid(*c)) {
                    return [0.0; 3];
                }
                let sum = corners.map(density);
                std::array::from_fn(|k| 0.25 * sum.iter().map(|d| d[k]).sum::<f64>())
            })
            .collect();
        Self {
            width,
            height,
            wraps,
            metric,
        }
    }

    /// The lattice of half the size, whose cells are as stiff as the four they stand for.
    pub fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let wraps = self.wraps && self.width.is_multiple_of(2);
        let metric = (0..width * height)
            .map(|i| {
                let (x, y) = (i % width, i / width);
                if (x + 1 == width && !wraps) || y + 1 == height {
                    return [0.0; 3];
                }
                // Pixels of the half lattice stand for two, so its cell begins half a pixel on.
                let at = |dx: usize, dy: usize| {
                    let (x, y) = ((2 * x + dx) % self.width, (2 * y + dy).min(self.height - 1));
                    self.metric[y * self.width + x]
                };
                let four = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
                std::array::from_fn(|k| 0.25 * four.iter().map(|m| m[k]).sum::<f64>())
            })
            .collect();
        Self {
            width,
            height,
            wraps,
            metric,
        }
    }
}

/// A symmetric matrix with the weights of the couplings to right, below, below right, below left.
#[derive(Clone, Debug)]
pub(crate) struct Stencil {
    pub width: usize,
    pub height: usize,
    wraps: bool,
    pub diagonal: Vec<f64>,
    east: Vec<f64>,
    south: Vec<f64>,
    south_east: Vec<f64>,
    south_west: Vec<f64>,
}

impl Stencil {
    /// The matrix of `scale` times the diffusion plus `mass` on the diagonal.
    pub fn new(cells: &Cells, scale: f64, mass: &[f64]) -> Self {
        let (width, height) = (cells.width, cells.height);
        let zero = || vec![0.0; width * height];
        let mut stencil = Self {
            width,
            height,
            wraps: cells.wraps,
            diagonal: mass.to_vec(),
            east: zero(),
            south: zero(),
            south_east: zero(),
            south_west: zero(),
        };
        for (i, [a, b, c]) in cells.metric.iter().enumerate() {
            if *a == 0.0 {
                continue;
            }
            let right = if (i + 1).is_multiple_of(width) {
                i + 1 - width
            } else {
                i + 1
            };
            let [a, b, c] = [0.5 * scale * a, 0.5 * scale * b, 0.5 * scale * c];
            stencil.east[i] += a;
            stencil.east[i + width] += a;
            stencil.south[i] += c;
            stencil.south[right] += c;
            // The product of both slopes of the cell is that of its two diagonals.
            stencil.south_east[i] += b;
            stencil.south_west[right] -= b;
            for pixel in [i, right, i + width, right + width] {
                stencil.diagonal[pixel] += a + c;
            }
            for (pixel, share) in [(i, b), (right + width, b), (right, -b), (i + width, -b)] {
                stencil.diagonal[pixel] += share;
            }
        }
        stencil
    }

    /// Columns to the left and the right; a column that does not exist has no weight, and may be any.
    #[inline]
    fn beside(&self, x: usize) -> (Option<usize>, Option<usize>) {
        let last = self.width - 1;
        let left = if x > 0 {
            Some(x - 1)
        } else {
            self.wraps.then_some(last)
        };
        let right = if x < last {
            Some(x + 1)
        } else {
            self.wraps.then_some(0)
        };
        (left, right)
    }

    /// What the neighbours of pixel `(x, y)` contribute: the sum of weight times value.
    #[inline]
    pub fn neighbours(&self, value: &[f64], x: usize, y: usize) -> f64 {
        let width = self.width;
        let here = y * width + x;
        if x > 0 && x + 1 < width && y > 0 && y + 1 < self.height {
            let (up, down) = (here - width, here + width);
            return self.east[here] * value[here + 1]
                + self.east[here - 1] * value[here - 1]
                + self.south[here] * value[down]
                + self.south[up] * value[up]
                + self.south_east[here] * value[down + 1]
                + self.south_east[up - 1] * value[up - 1]
                + self.south_west[here] * value[down - 1]
                + self.south_west[up + 1] * value[up + 1];
        }
        self.border_neighbours(value, x, y)
    }

    fn border_neighbours(&self, value: &[f64], x: usize, y: usize) -> f64 {
        let width = self.width;
        let (row, here) = (y * width, y * width + x);
        let (left, right) = self.beside(x);
        let mut sum = 0.0;
        if let Some(right) = right {
            sum += self.east[here] * value[row + right];
        }
        if let Some(left) = left {
            sum += self.east[row + left] * value[row + left];
        }
        if y + 1 < self.height {
            let below = row + width;
            sum += self.south[here] * value[below + x];
            sum += right.map_or(0.0, |r| self.south_east[here] * value[below + r]);
            sum += left.map_or(0.0, |l| self.south_west[here] * value[below + l]);
        }
        if y > 0 {
            let above = row - width;
            sum += self.south[above + x] * value[above + x];
            sum += left.map_or(0.0, |l| self.south_east[above + l] * value[above + l]);
            sum += right.map_or(0.0, |r| self.south_west[above + r] * value[above + r]);
        }
        sum
    }

    /// The matrix times `value`.
    pub fn apply(&self, value: &[f64], out: &mut [f64]) {
        let width = self.width;
        out.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
            for (x, out) in out.iter_mut().enumerate() {
                let here = y * width + x;
                *out = self.diagonal[here] * value[here] - self.neighbours(value, x, y);
            }
        });
    }

    /// One sweep of Gauss and Seidel in place, forwards or backwards.
    pub fn relax(&self, value: &mut [f64], right_side: &[f64], backwards: bool) {
        let (width, height) = (self.width, self.height);
        let mut pixel = |x: usize, y: usize| {
            let here = y * width + x;
            let diagonal = self.diagonal[here];
            if diagonal > 0.0 {
                value[here] = (right_side[here] + self.neighbours(value, x, y)) / diagonal;
            }
        };
        for row in 0..height {
            let y = if backwards { height - 1 - row } else { row };
            for column in 0..width {
                let x = if backwards {
                    width - 1 - column
                } else {
                    column
                };
                pixel(x, y);
            }
        }
    }
}
