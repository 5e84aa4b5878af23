//! Sparse Cholesky factorisation block by block, for factors of short columns.
//!
//! Poses tied to a few others each leave columns of a few blocks, for which panels are too much ado
//! and single numbers too slow. Column by column (left-looking): what the columns before take from
//! it, the factor of its diagonal block, and the blocks below over that.

use super::BlockPattern;
use super::fill::Fill;
use super::kernel::{divide, factor_diagonal, subtract};

/// A block of the matrix: offset among its numbers, offset in the factor's column, and whether it is
/// transposed there.
struct Source {
    from: usize,
    to: usize,
    rows: u32,
    columns: u32,
    transposed: bool,
}

/// A block of a column before, in the row of the column under way.
struct Left {
    /// Its index among all blocks, and one past the last of its column.
    block: u32,
    end: u32,
}

pub(super) struct BlockCholesky {
    /// First scalar row at each place of the order, and where it is in the matrix.
    starts: Vec<usize>,
    origins: Vec<usize>,
    sizes: Vec<u32>,
    column_starts: Vec<usize>,
    rows: Vec<u32>,
    /// Offset of each block's numbers; one more at the end.
    offsets: Vec<usize>,
    sources: Vec<Source>,
    source_starts: Vec<usize>,
    lefts: Vec<Left>,
    left_starts: Vec<usize>,
    /// Offset of the block in each row of the column under way, from the beginning of the column.
    at: Vec<usize>,
    values: Vec<f64>,
    /// Reciprocals of the diagonal.
    reciprocals: Vec<f64>,
    x: Vec<f64>,
}

impl BlockCholesky {
    pub fn new(pattern: &BlockPattern, fill: Fill) -> Self {
        let count = pattern.blocks();
        let size = |place: usize| pattern.size(fill.order[place] as usize);
        let mut starts = vec![0];
        for place in 0..count {
            starts.push(starts[place] + size(place));
        }
        let mut offsets = vec![0];
        let (mut lefts, mut left_starts) = (Vec::new(), vec![0_usize; count + 1]);
        for column in 0..count {
            for k in fill.column_starts[column]..fill.column_starts[column + 1] {
                let row = fill.rows[k] as usize;
                offsets.push(offsets[k] + size(row) * size(column));
                left_starts[row + 1] += usize::from(row != column);
            }
        }
        for row in 0..count {
            left_starts[row + 1] += left_starts[row];
        }
        lefts.resize_with(left_starts[count], || Left { block: 0, end: 0 });
        let mut next = left_starts.clone();
        for column in 0..count {
            let end = fill.column_starts[column + 1];
            for k in fill.column_starts[column] + 1..end {
                let row = fill.rows[k] as usize;
                lefts[next[row]] = Left {
                    block: k as u32,
                    end: end as u32,
                };
                next[row] += 1;
            }
        }
        let (source_starts, sources) = sources(pattern, &fill, &offsets);
        Self {
            origins: (0..count)
                .map(|place| pattern.start(fill.order[place] as usize))
                .collect(),
            sizes: (0..count).map(|place| size(place) as u32).collect(),
            at: vec![0; count],
            values: vec![0.0; offsets.last().copied().unwrap_or(0)],
            reciprocals: vec![0.0; pattern.dimension()],
            x: vec![0.0; pattern.dimension()],
            starts,
            column_starts: fill.column_starts,
            rows: fill.rows,
            offsets,
            sources,
            source_starts,
            lefts,
            left_starts,
        }
    }

    /// Numbers in the factor.
    pub fn factor_len(&self) -> usize {
        self.values.len()
    }

    /// False where the matrix is not positive definite.
    pub fn factor(&mut self, values: &[f64]) -> bool {
        pulp::Arch::new().dispatch(Factor(self, values))
    }

    /// In place, with the matrix last factored.
    pub fn solve(&mut self, x: &mut [f64]) {
        pulp::Arch::new().dispatch(Solve(self, x));
    }

    #[inline(always)]
    fn column(&mut self, column: usize, matrix: &[f64]) -> bool {
        let blocks = self.column_starts[column]..self.column_starts[column + 1];
        let first = self.offsets[blocks.start];
        let width = self.sizes[column] as usize;
        let (before, rest) = self.values.split_at_mut(first);
        let here = &mut rest[..self.offsets[blocks.end] - first];
        here.fill(0.0);
        for source in &self.sources[self.source_starts[column]..self.source_starts[column + 1]] {
            source.copy(matrix, here);
        }
        for k in blocks.clone() {
            self.at[self.rows[k] as usize] = self.offsets[k] - first;
        }
        for left in &self.lefts[self.left_starts[column]..self.left_starts[column + 1]] {
            let (block, end) = (left.block as usize, left.end as usize);
            let across = &before[self.offsets[block]..self.offsets[block + 1]];
            for k in block..end {
                let row = self.rows[k] as usize;
                let height = self.sizes[row] as usize;
                let down = &before[self.offsets[k]..self.offsets[k + 1]];
                let to = self.at[row];
                subtract(
                    &mut here[to..to + height * width],
                    down,
                    across,
                    height,
                    width,
                );
            }
        }
        let (diagonal, below) = here.split_at_mut(width * width);
        let start = self.starts[column];
        let reciprocals = &mut self.reciprocals[start..start + width];
        if !factor_diagonal(diagonal, reciprocals) {
            return false;
        }
        let mut to = 0;
        for k in blocks.start + 1..blocks.end {
            let height = self.sizes[self.rows[k] as usize] as usize;
            divide(
                &mut below[to..to + height * width],
                diagonal,
                reciprocals,
                height,
            );
            to += height * width;
        }
        true
    }

    #[inline(always)]
    fn substitute(&mut self, b: &mut [f64]) {
        for (place, &from) in self.origins.iter().enumerate() {
            let (start, size) = (self.starts[place], self.sizes[place] as usize);
            self.x[start..start + size].copy_from_slice(&b[from..from + size]);
        }
        for column in 0..self.sizes.len() {
            self.forward(column);
        }
        for column in (0..self.sizes.len()).rev() {
            self.backward(column);
        }
        for (place, &to) in self.origins.iter().enumerate() {
            let (start, size) = (self.starts[place], self.sizes[place] as usize);
            b[to..to + size].copy_from_slice(&self.x[start..start + size]);
        }
    }

    /// `L x = b`, of this column.
    #[inline(always)]
    fn forward(&mut self, column: usize) {
        let (start, width) = (self.starts[column], self.sizes[column] as usize);
        let (head, tail) = self.x.split_at_mut(start + width);
        let head = &mut head[start..];
        let blocks = self.column_starts[column]..self.column_starts[column + 1];
        let l = &self.values[self.offsets[blocks.start]..];
        for c in 0..width {
            head[c] *= self.reciprocals[start + c];
            for r in c + 1..width {
                head[r] -= l[c * width + r] * head[c];
            }
        }
        for k in blocks.start + 1..blocks.end {
            let row = self.rows[k] as usize;
            let (to, height) = (self.starts[row] - start - width, self.sizes[row] as usize);
            let l = &self.values[self.offsets[k]..self.offsets[k + 1]];
            for (l, x) in l.chunks_exact(height).zip(head.iter()) {
                for (to, l) in tail[to..to + height].iter_mut().zip(l) {
                    *to -= l * x;
                }
            }
        }
    }

    /// `L^T x = b`, of this column.
    #[inline(always)]
    fn backward(&mut self, column: usize) {
        let (start, width) = (self.starts[column], self.sizes[column] as usize);
        let (head, tail) = self.x.split_at_mut(start + width);
        let head = &mut head[start..];
        let blocks = self.column_starts[column]..self.column_starts[column + 1];
        for k in blocks.start + 1..blocks.end {
            let row = self.rows[k] as usize;
            let (from, height) = (self.starts[row] - start - width, self.sizes[row] as usize);
            let l = &self.values[self.offsets[k]..self.offsets[k + 1]];
            for (l, x) in l.chunks_exact(height).zip(head.iter_mut()) {
                let products = l.iter().zip(&tail[from..from + height]);
                *x -= products.map(|(l, x)| l * x).sum::<f64>();
            }
        }
        let l = &self.values[self.offsets[blocks.start]..];
        for c in (0..width).rev() {
            let sum: f64 = (c + 1..width).map(|r| l[c * width + r] * head[r]).sum();
            head[c] = (head[c] - sum) * self.reciprocals[start + c];
        }
    }
}

impl Source {
    #[inline(always)]
    fn copy(&self, matrix: &[f64], column: &mut [f64]) {
        let (rows, columns) = (self.rows as usize, self.columns as usize);
        let from = &matrix[self.from..self.from + rows * columns];
        let to = &mut column[self.to..self.to + rows * columns];
        if !self.transposed {
            to.copy_from_slice(from);
            return;
        }
        for c in 0..columns {
            for r in 0..rows {
                to[c * rows + r] = from[r * columns + c];
            }
        }
    }
}

/// Where the numbers of the matrix go, by columns of the factor.
fn sources(pattern: &BlockPattern, fill: &Fill, offsets: &[usize]) -> (Vec<usize>, Vec<Source>) {
    let count = pattern.blocks();
    let mut place = vec![0_usize; count];
    for (at, &block) in fill.order.iter().enumerate() {
        place[block as usize] = at;
    }
    let mut all: Vec<(usize, Source)> = Vec::new();
    for block in 0..count {
        for (other, from) in pattern.column(block) {
            let transposed = place[other] < place[block];
            let (row, column) = if transposed {
                (block, other)
            } else {
                (other, block)
            };
            let (first, end) = (
                fill.column_starts[place[column]],
                fill.column_starts[place[column] + 1],
            );
            let found = fill.rows[first..end].binary_search(&(place[row] as u32));
            // a block of the matrix is one of its factor
            let to = found.map_or(0, |k| offsets[first + k] - offsets[first]);
            let source = Source {
                from,
                to,
                rows: pattern.size(row) as u32,
                columns: pattern.size(column) as u32,
                transposed,
            };
            all.push((place[column], source));
        }
    }
    all.sort_by_key(|(column, _)| *column);
    let mut starts = vec![0; count + 1];
    for (column, _) in &all {
        starts[column + 1] += 1;
    }
    for column in 0..count {
        starts[column + 1] += starts[column];
    }
    (starts, all.into_iter().map(|(_, source)| source).collect())
}

struct Factor<'a>(&'a mut BlockCholesky, &'a [f64]);
struct Solve<'a>(&'a mut BlockCholesky, &'a mut [f64]);

impl pulp::WithSimd for Factor<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> bool {
        let Self(solver, matrix) = self;
        (0..solver.sizes.len()).all(|column| solver.column(column, matrix))
    }
}

impl pulp::WithSimd for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        self.0.substitute(self.1);
    }
}
