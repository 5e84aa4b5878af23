//! The weak form: one balance of inverse range for each domain, linear in omega and v.
//!
//! With gamma = 1/D, (1.17) becomes
//! `d gamma/dt = -div(gamma eta x omega) - 1/2 div(gamma^2 eta x (eta x v)) + 2 gamma^2 eta.v`
//! because `div(eta x omega) = 0` and `div(eta x (eta x v)) = +2 eta.v`.
//!
//! Thesis: section 6.1 prints the last divergence, citing appendix A.4, as -2 eta.v, with which the
//! terms in eta.v of (6.1) would add up instead of cancelling. Its results (6.2), (6.3) are right.
//!
//! By Stokes, over a domain with outward normal n,
//!
//! `d/dt int gamma = [oint gamma eta x n].omega + [oint gamma^2/2 n + int 2 gamma^2 eta].v`
//!
//! It is the thesis's balance with gamma in the place of D^3: for any function F of the range and
//! G' = F'/D the coefficient of v is `oint G n + int (2G - F') eta`, which loses its second part
//! for F = D^3. The noise of depth cameras is uniform in gamma, and far walls do not rule the sums.

use crate::area_integrals::AreaIntegrals;
use crate::cell_sums::CellSums;
use crate::pair::Pair;
use crate::sphere_table::{Edge, SphereTable};
use crate::tiling::Tiling;

/// The pass over the image.
pub struct WeakForm<'a> {
    /// The rays of the blocks.
    pub table: &'a SphereTable,
    /// The domains that they are summed over.
    pub tiling: &'a Tiling,
    /// Both images.
    pub pair: &'a Pair,
    /// Relative difference between neighbours from which no line is drawn through them.
    pub max_jump: f32,
}

/// A struct instead of a closure: only so is the body compiled for the processor at hand.
struct AddAll<'a>(&'a WeakForm<'a>, &'a mut [CellSums], &'a mut AreaIntegrals);

impl pulp::WithSimd for AddAll<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        self.0.add_all(self.1, self.2);
    }
}

impl WeakForm<'_> {
    /// All sums of all domains, in one pass. The contour takes the mean of both images of gamma
    /// and of gamma^2 (trapezoid rule in time). `inside` is working memory.
    ///
    /// Thesis: eq. (6.2), eq. (6.3), with gamma in the place of D^3.
    pub fn accumulate(&self, sums: &mut Vec<CellSums>, inside: &mut AreaIntegrals) {
        sums.clear();
        sums.resize(self.tiling.cells, CellSums::default());
        pulp::Arch::new().dispatch(AddAll(self, sums, inside));
    }

    #[inline(always)]
    fn add_all(&self, sums: &mut [CellSums], inside: &mut AreaIntegrals) {
        let tiling = self.tiling;
        inside.start(self.table.width);
        for y in 0..self.table.height {
            inside.add(self.pair, self.table, y);
            if tiling.row.get(y + 1) != Some(&tiling.row[y]) {
                inside.finish(tiling, tiling.row[y], sums);
            }
            self.add_upright_edges(y, sums);
        }
        for y in 0..=self.table.height {
            self.add_level_edges(y, sums);
        }
    }

    /// Edges between neighbours of a row. An edge inside a domain cancels and is left out.
    #[inline(always)]
    fn add_upright_edges(&self, y: usize, sums: &mut [CellSums]) {
        let (width, row) = (self.table.width, self.tiling.row[y]);
        let at = |x: isize| self.index(x, y);
        for x in 0..width + usize::from(!self.table.wraps) {
            let x = x as isize;
            let (a, b) = (at(x - 1), at(x));
            let cell = |i: usize| (row + self.tiling.column[i % width]) as usize;
            let (cell_a, cell_b) = (a.map(cell), b.map(cell));
            if (self.known(a), self.known(b)) == (false, false)
                || (cell_a == cell_b && self.known(a) == self.known(b))
            {
                continue;
            }
            let edge = &self.table.left[y * (width + 1) + x as usize];
            let value = self.edge_value([at(x - 2), a, b, at(x + 1)]);
            self.add_edge(edge, value, cell_a.filter(|_| self.known(a)), sums, 1.0);
            self.add_edge(edge, value, cell_b.filter(|_| self.known(b)), sums, -1.0);
        }
    }

    /// Edges between the rows `y - 1` and `y`.
    #[inline(always)]
    fn add_level_edges(&self, y: usize, sums: &mut [CellSums]) {
        let (width, height) = (self.table.width, self.table.height);
        let at = |x: usize, y: Option<usize>| y.filter(|&y| y < height).map(|y| y * width + x);
        let row = |y: Option<usize>| y.and_then(|y| self.tiling.row.get(y)).copied();
        let (row_a, row_b) = (row(y.checked_sub(1)), row(Some(y)));
        for x in 0..width {
            let (a, b) = (at(x, y.checked_sub(1)), at(x, Some(y)));
            let (known_a, known_b) = (self.known(a), self.known(b));
            if !(known_a || known_b) || (row_a == row_b && known_a == known_b) {
                continue;
            }
            let edge = &self.table.top[y * width + x];
            let value = self.edge_value([at(x, y.checked_sub(2)), a, b, at(x, Some(y + 1))]);
            let cell = |row: Option<u32>| row.map(|row| (row + self.tiling.column[x]) as usize);
            self.add_edge(edge, value, cell(row_a).filter(|_| known_a), sums, 1.0);
            self.add_edge(edge, value, cell(row_b).filter(|_| known_b), sums, -1.0);
        }
    }

    /// Index of block `(x, y)`, around the seam where the image has one.
    fn index(&self, x: isize, y: usize) -> Option<usize> {
        let width = self.table.width as isize;
        let x = if self.table.wraps {
            x.rem_euclid(width)
        } else {
            x
        };
        (0..width)
            .contains(&x)
            .then(|| y * self.table.width + x as usize)
    }

    #[inline(always)]
    fn known(&self, i: Option<usize>) -> bool {
        i.is_some_and(|i| !self.pair.mean[i].is_nan())
    }

    /// Mean and half difference on the edge between the middle two of four blocks in a line. Where
    /// only one of them is known, the line through it and the block behind it goes on to the edge:
    /// the plain value would be wrong by half a block's slope.
    fn edge_value(&self, line: [Option<usize>; 4]) -> (f32, f32) {
        let get = |i: Option<usize>| {
            i.map_or((f32::NAN, f32::NAN), |i| {
                (self.pair.mean[i], self.pair.half[i])
            })
        };
        let (a, b) = (get(line[1]), get(line[2]));
        match (a.0.is_nan(), b.0.is_nan()) {
            (false, false) => (0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1)),
            (false, true) => self.extrapolate(a, get(line[0])),
            (true, false) => self.extrapolate(b, get(line[3])),
            (true, true) => (f32::NAN, f32::NAN),
        }
    }

    fn extrapolate(&self, near: (f32, f32), inner: (f32, f32)) -> (f32, f32) {
        let smooth = (near.0 - inner.0).abs() <= self.max_jump * near.0; // false for NaN
        if smooth {
            (1.5 * near.0 - 0.5 * inner.0, 1.5 * near.1 - 0.5 * inner.1)
        } else {
            near
        }
    }

    #[inline(always)]
    fn add_edge(
        &self,
        edge: &Edge,
        (mean, half): (f32, f32),
        cell: Option<usize>,
        sums: &mut [CellSums],
        sign: f64,
    ) {
        let Some(cell) = cell else { return };
        let square = sign * 0.5 * f64::from(mean * mean + half * half);
        let gamma = sign * f64::from(mean);
        let coefficients = &mut sums[cell].coefficients;
        for k in 0..3 {
            coefficients[k] += gamma * f64::from(edge.tangent[k]);
            coefficients[3 + k] += square * f64::from(edge.normal[k]);
        }
    }
}
