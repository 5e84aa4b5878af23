//! Sums over the pixels of a surface in a cell from which a plane can be fitted.

use super::CELL;
use crate::filter::lattice::Lattice;
use crate::filter::state::Node;
use crate::filter::surfaces::ONE_SURFACE;
use nalgebra::{Matrix3, Vector3};

/// Moments of the information on a surface in a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moments {
    /// sum s b b'
    pub matrix: Matrix3<f64>,
    /// sum s b m
    pub vector: Vector3<f64>,
    /// sum s m^2
    pub square: f64,
    /// sum s
    pub weight: f64,
    /// Mean of b b' over the pixels, times their number: the shape of the cell.
    pub shape: Matrix3<f64>,
    pub pixels: f64,
    pub state: State,
}

/// Sums of the state's zeta and its variance, every pixel alike.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    /// sum 1, x, y, x x, x y, y y, with (x, y) the pixel.
    place: [f64; 6],
    /// sum zeta, zeta x, zeta y.
    zeta: [f64; 3],
    variance: f64,
    /// sum b
    ray: Vector3<f64>,
}

/// b in the middle of a cell and its slopes by column and row, from the pixels around the middle.
pub(super) fn basis(lattice: &Lattice, column: usize, row: usize) -> Matrix3<f64> {
    let (x0, y0) = (column * CELL, row * CELL);
    let (x1, y1) = (
        (x0 + CELL - 1).min(lattice.width - 1),
        (y0 + CELL - 1).min(lattice.height - 1),
    );
    let at = |x: usize, y: usize| lattice.ray[y * lattice.width + x].cast::<f64>();
    let (a, b, c, d) = (at(x0, y0), at(x1, y0), at(x0, y1), at(x1, y1));
    let middle = (a + b + c + d) / 4.0;
    let across = (b - a + d - c) / (2.0 * (x1 - x0).max(1) as f64);
    let down = (c - a + d - b) / (2.0 * (y1 - y0).max(1) as f64);
    Matrix3::from_columns(&[middle, across, down])
}

/// The pixels of a finest cell, and what the rays do there.
pub(super) struct Cell<'a> {
    pub lattice: &'a Lattice,
    pub nodes: &'a [Node],
    pub column: usize,
    pub row: usize,
    pub base: &'a Matrix3<f64>,
}

impl Cell<'_> {
    /// First and last pixel (exclusive) by column and row.
    fn bounds(&self) -> ([usize; 2], [usize; 2]) {
        let (x0, y0) = (self.column * CELL, self.row * CELL);
        (
            [x0, (x0 + CELL).min(self.lattice.width)],
            [y0, (y0 + CELL).min(self.lattice.height)],
        )
    }

    /// Least and largest zeta of the pixels that know theirs.
    pub fn extremes(&self) -> [f32; 2] {
        let ([x0, x1], [y0, y1]) = self.bounds();
        let mut found = [f32::INFINITY, 0.0_f32];
        for y in y0..y1 {
            for node in &self.nodes[y * self.lattice.width..][x0..x1] {
                if super::knows(node) {
                    found = [found[0].min(node[0]), found[1].max(node[0])];
                }
            }
        }
        found
    }

    /// The moments of all pixels.
    pub fn moments(&self) -> Moments {
        self.moments_of(|_| true)
    }

    /// The moments of the pixels nearer and farther than `zeta`. What changes much within a cell says nothing of
    /// the slope of either surface.
    pub fn divided(&self, zeta: f32) -> [Moments; 2] {
        /// Variance of places, in pixels, that pretends to know that there is no slope.
        const LEVEL: f64 = 100.0;
        let mut both = [
            self.moments_of(|x| x > zeta),
            self.moments_of(|x| x <= zeta),
        ];
        for moments in &mut both {
            moments.state.place[3] += LEVEL * moments.pixels;
            moments.state.place[5] += LEVEL * moments.pixels;
        }
        both
    }

    #[inline(always)]
    fn moments_of(&self, belongs: impl Fn(f32) -> bool) -> Moments {
        let ([x0, x1], [y0, y1]) = self.bounds();
        let (cx, cy) = (0.5 * (x0 + x1 - 1) as f32, 0.5 * (y0 + y1 - 1) as f32);
        let width = self.lattice.width;
        let reference = self.nodes[(y0 + y1) / 2 * width + (x0 + x1) / 2][0];
        if !self.base.iter().all(|v| v.is_finite()) || reference.is_nan() {
            return Moments::NOTHING;
        }
        // s, s dx, s dy, s dx^2, s dx dy, s dy^2, s d, s d dx, s d dy, s d^2; and of the state
        // 1, dx, dy, dx^2, dx dy, dy^2, d, d dx, d dy, variance
        let (mut sum, mut state) = ([0.0_f32; 10], [0.0_f32; 10]);
        for y in y0..y1 {
            let dy = y as f32 - cy;
            for (x, node) in self.nodes[y * width..][x0..x1].iter().enumerate() {
                let dx = (x0 + x) as f32 - cx;
                let [x, q, s, variance] = *node;
                let one = if belongs(x) { 1.0 } else { 0.0 };
                let s = s * one;
                // A pixel without a ray has no information and no zeta.
                let d = if s > 0.0 { x - reference } else { 0.0 };
                let sd = s * d + one * q;
                // s m^2 = (s d + q)^2 / s
                let square = if s > 0.0 { sd * sd / s } else { 0.0 };
                let (sx, sy) = (s * dx, s * dy);
                let terms = [
                    s,
                    sx,
                    sy,
                    sx * dx,
                    sx * dy,
                    sy * dy,
                    sd,
                    sd * dx,
                    sd * dy,
                    square,
                ];
                for (sum, term) in sum.iter_mut().zip(terms) {
                    *sum += term;
                }
                let (zx, zy, zeta) = (one * dx, one * dy, one * d);
                let variance = if s > 0.0 { one * variance } else { 0.0 };
                let terms = [
                    one,
                    zx,
                    zy,
                    zx * dx,
                    zx * dy,
                    zy * dy,
                    zeta,
                    zeta * dx,
                    zeta * dy,
                    variance,
                ];
                for (sum, term) in state.iter_mut().zip(terms) {
                    *sum += term;
                }
            }
        }
        self.gathered(&sum.map(f64::from), &state.map(f64::from), reference)
    }

    /// From sums about the middle of the cell and one of its values to those of rays and whole zetas.
    fn gathered(&self, sum: &[f64; 10], state: &[f64; 10], reference: f32) -> Moments {
        let ([x0, x1], [y0, y1]) = self.bounds();
        let (cx, cy) = (0.5 * (x0 + x1 - 1) as f64, 0.5 * (y0 + y1 - 1) as f64);
        let reference = f64::from(reference);
        let base = self.base;
        let symmetric =
            |m: &[f64]| Matrix3::new(m[0], m[1], m[2], m[1], m[3], m[4], m[2], m[4], m[5]);
        let [s, sx, sy, _, _, _, sd, sdx, sdy, square] = *sum;
        let moment = Vector3::new(s, sx, sy) * reference + Vector3::new(sd, sdx, sdy);
        let [n, nx, ny, nxx, nxy, nyy, z, zx, zy, variance] = *state;
        let zeta = [z + n * reference, zx + nx * reference, zy + ny * reference];
        Moments {
            matrix: base * symmetric(sum) * base.transpose(),
            vector: base * moment,
            square: square + reference * (2.0 * sd + reference * s),
            weight: s,
            shape: base * symmetric(state) * base.transpose(),
            pixels: n,
            state: State {
                place: [
                    n,
                    nx + cx * n,
                    ny + cy * n,
                    nxx + cx * (2.0 * nx + cx * n),
                    nxy + cx * ny + cy * nx + cx * cy * n,
                    nyy + cy * (2.0 * ny + cy * n),
                ],
                zeta: [zeta[0], zeta[1] + cx * zeta[0], zeta[2] + cy * zeta[0]],
                variance,
                ray: base * Vector3::new(n, nx, ny),
            },
        }
    }
}

impl Moments {
    pub const NOTHING: Self = Self {
        matrix: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        vector: Vector3::new(0.0, 0.0, 0.0),
        square: 0.0,
        weight: 0.0,
        shape: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        pixels: 0.0,
        state: State {
            place: [0.0; 6],
            zeta: [0.0; 3],
            variance: 0.0,
            ray: Vector3::new(0.0, 0.0, 0.0),
        },
    };

    pub fn add(&mut self, other: &Self) {
        self.matrix += other.matrix;
        self.vector += other.vector;
        self.square += other.square;
        self.weight += other.weight;
        self.shape += other.shape;
        self.pixels += other.pixels;
        let (to, from) = (&mut self.state, &other.state);
        to.place
            .iter_mut()
            .zip(from.place)
            .for_each(|(a, b)| *a += b);
        to.zeta.iter_mut().zip(from.zeta).for_each(|(a, b)| *a += b);
        to.variance += from.variance;
        to.ray += from.ray;
    }

    /// Mean ray of the pixels.
    pub fn ray(&self) -> Vector3<f64> {
        self.state.ray / self.pixels
    }

    /// The surface as the state has it.
    pub fn face(&self) -> Face {
        /// Variance of places, in pixels, below which slopes are not believed.
        const LEVEL: f64 = 0.3;
        let n = 1.0 / self.state.place[0];
        let [_, x, y, xx, xy, yy] = self.state.place.map(|sum| sum * n);
        let [z, zx, zy] = self.state.zeta.map(|sum| sum * n);
        let (xx, xy, yy) = (xx - x * x + LEVEL, xy - x * y, yy - y * y + LEVEL);
        let (zx, zy) = (zx - z * x, zy - z * y);
        let scale = 1.0 / (xx * yy - xy * xy);
        Face {
            zeta: z,
            place: [x, y],
            slope: [scale * (yy * zx - xy * zy), scale * (xx * zy - xy * zx)],
            variance: (self.state.variance * n).max(self.pixels / self.weight),
        }
    }
}

/// A surface in the state: zeta and its slope by pixel in the middle of the pixels it has.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    pub zeta: f64,
    pub place: [f64; 2],
    pub slope: [f64; 2],
    pub variance: f64,
}

impl Face {
    /// How far two surfaces lie apart half-way between their middles, in units of what lets them be one: above 1
    /// they are two.
    pub fn apart(&self, other: &Self) -> f64 {
        let half = |k: usize| 0.5 * (other.place[k] - self.place[k]);
        let reach = |face: &Self| face.slope[0] * half(0) + face.slope[1] * half(1);
        let gap = (other.zeta - reach(other)) - (self.zeta + reach(self));
        let own = ONE_SURFACE * self.zeta.min(other.zeta);
        let doubt = 4.0 * (self.variance + other.variance);
        gap.abs() / own.max(doubt.sqrt())
    }
}
