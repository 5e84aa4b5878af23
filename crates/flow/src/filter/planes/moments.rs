//! Sums over the pixels of a cell from which a plane can be fitted.

use super::CELL;
use crate::filter::lattice::Lattice;
use crate::filter::state::Node;
use nalgebra::{Matrix3, Vector3};

/// Moments of the information in a cell.
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

pub(super) fn cell_moments(
    lattice: &Lattice,
    nodes: &[Node],
    (column, row): (usize, usize),
    base: &Matrix3<f64>,
) -> Moments {
    let (x0, y0) = (column * CELL, row * CELL);
    let (x1, y1) = (
        (x0 + CELL).min(lattice.width),
        (y0 + CELL).min(lattice.height),
    );
    let (cx, cy) = (0.5 * (x0 + x1 - 1) as f32, 0.5 * (y0 + y1 - 1) as f32);
    if !base.iter().all(|v| v.is_finite()) {
        return Moments::NOTHING;
    }
    let reference = nodes[(y0 + y1) / 2 * lattice.width + (x0 + x1) / 2][0];
    if reference.is_nan() {
        return Moments::NOTHING;
    }
    // s, s dx, s dy, s dx^2, s dx dy, s dy^2, s d, s d dx, s d dy, s d^2
    let mut sum = [0.0_f32; 10];
    for y in y0..y1 {
        let dy = y as f32 - cy;
        for (x, node) in nodes[y * lattice.width..][x0..x1].iter().enumerate() {
            let dx = (x0 + x) as f32 - cx;
            let [x, q, s, _] = *node;
            // A pixel without a ray has no information and no zeta.
            let d = if s > 0.0 { x - reference } else { 0.0 };
            let sd = s * d + q;
            // s m^2 = (s d + q)^2 / s
            let square = if s > 0.0 { sd * sd / s } else { 0.0 };
            let terms = [
                s,
                s * dx,
                s * dy,
                s * dx * dx,
                s * dx * dy,
                s * dy * dy,
                sd,
                sd * dx,
                sd * dy,
                square,
            ];
            for (sum, term) in sum.iter_mut().zip(terms) {
                *sum += term;
            }
        }
    }
    let [s, sx, sy, sxx, sxy, syy, sd, sdx, sdy, square] = sum.map(f64::from);
    let local = Matrix3::new(s, sx, sy, sx, sxx, sxy, sy, sxy, syy);
    let moment = Vector3::new(s, sx, sy) * f64::from(reference) + Vector3::new(sd, sdx, sdy);
    let (wide, high) = ((x1 - x0) as f64, (y1 - y0) as f64);
    let shape = Vector3::new(1.0, (wide * wide - 1.0) / 12.0, (high * high - 1.0) / 12.0);
    let reference = f64::from(reference);
    Moments {
        matrix: base * local * base.transpose(),
        vector: base * moment,
        square: square + reference * (2.0 * sd + reference * s),
        weight: s,
        shape: base * Matrix3::from_diagonal(&shape) * base.transpose() * (wide * high),
        pixels: wide * high,
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
    };

    pub fn add(&mut self, other: &Self) {
        self.matrix += other.matrix;
        self.vector += other.vector;
        self.square += other.square;
        self.weight += other.weight;
        self.shape += other.shape;
        self.pixels += other.pixels;
    }
}
