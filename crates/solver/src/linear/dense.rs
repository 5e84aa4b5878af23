//! Dense Cholesky factorisation.

use super::BlockPattern;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::{factor, solve};
use faer::{Mat, MatMut, Par};

/// From this many unknowns on the work is split, always into the same number of parts, so that the
/// result does not depend on the number of threads.
const PARALLEL: usize = 600;
const PARTS: usize = 4;

pub(super) struct DenseCholesky {
    matrix: Mat<f64>,
    memory: MemBuffer,
    par: Par,
}

impl DenseCholesky {
    pub fn new(n: usize) -> Self {
        let par = if n >= PARALLEL {
            Par::rayon(PARTS)
        } else {
            Par::Seq
        };
        let need = factor::cholesky_in_place_scratch::<f64>(n, par, Default::default());
        Self {
            matrix: Mat::zeros(n, n),
            memory: MemBuffer::new(need),
            par,
        }
    }

    pub fn factor(&mut self, pattern: &BlockPattern, values: &[f64]) -> bool {
        self.matrix.fill(0.0);
        for column in 0..pattern.blocks() {
            let (width, c0) = (pattern.size(column), pattern.start(column));
            for (row, offset) in pattern.column(column) {
                let (height, r0) = (pattern.size(row), pattern.start(row));
                for c in 0..width {
                    for r in 0..height {
                        self.matrix[(r0 + r, c0 + c)] = values[offset + c * height + r];
                    }
                }
            }
        }
        factor::cholesky_in_place(
            self.matrix.as_mut(),
            Default::default(),
            self.par,
            MemStack::new(&mut self.memory),
            Default::default(),
        )
        .is_ok()
    }

    pub fn solve(&mut self, x: &mut [f64]) {
        let n = x.len();
        solve::solve_in_place(
            self.matrix.as_ref(),
            MatMut::from_column_major_slice_mut(x, n, 1),
            self.par,
            MemStack::new(&mut self.memory),
        );
    }
}
