//! Sparse Cholesky factorisation: the order of elimination, and by blocks or by panels.

use super::BlockPattern;
use super::blocks::BlockCholesky;
use super::dissection::{self, Neighbours};
use super::fill::Fill;
use super::supernodes::SupernodalCholesky;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

/// From this many blocks on it is worth looking for separators; below, minimum degree is as good.
const DISSECTED: usize = 1500;
/// Products for each number of the factor (a mean over the columns of the rows that each has) from
/// which dense panels are faster than blocks: 54 in a graph of few loops, where blocks take half the
/// time, 115 in a grid of 900 poses, where both take as long.
const PANELS: f64 = 110.0;

enum Method {
    Blocks(BlockCholesky),
    Panels(SupernodalCholesky),
}

pub(super) struct SparseCholesky {
    method: Method,
}

impl SparseCholesky {
    /// `None` where the ordering or the symbolic factorisation fails (too large for the memory).
    pub fn new(pattern: &BlockPattern) -> Option<Self> {
        let mut order = minimum_degree(pattern)?;
        let mut fill = Fill::new(pattern, &order);
        if pattern.blocks() >= DISSECTED {
            let dissected = dissection::order(&Neighbours::new(pattern), &order);
            let other = Fill::new(pattern, &dissected);
            let better = match (&fill, &other) {
                (Some(first), Some(other)) => other.len < first.len,
                (None, _) => true,
                _ => false,
            };
            if better {
                (order, fill) = (dissected, other);
            }
        }
        let method = match fill {
            Some(fill) if fill.products < PANELS * fill.len as f64 => {
                Method::Blocks(BlockCholesky::new(pattern, fill))
            }
            _ => Method::Panels(SupernodalCholesky::new(pattern, &order)?),
        };
        Some(Self { method })
    }

    /// Numbers in the factor.
    pub fn factor_len(&self) -> usize {
        match &self.method {
            Method::Blocks(solver) => solver.factor_len(),
            Method::Panels(solver) => solver.factor_len(),
        }
    }

    /// False where the matrix is not positive definite.
    pub fn factor(&mut self, values: &[f64]) -> bool {
        match &mut self.method {
            Method::Blocks(solver) => solver.factor(values),
            Method::Panels(solver) => solver.factor(values),
        }
    }

    /// In place, with the matrix last factored.
    pub fn solve(&mut self, x: &mut [f64]) {
        match &mut self.method {
            Method::Blocks(solver) => solver.solve(x),
            Method::Panels(solver) => solver.solve(x),
        }
    }
}

/// The blocks by approximate minimum degree.
fn minimum_degree(pattern: &BlockPattern) -> Option<Vec<usize>> {
    let n = pattern.blocks();
    let (mut starts, mut rows) = (vec![0], Vec::new());
    for column in 0..n {
        rows.extend(pattern.column(column).map(|(row, _)| row));
        starts.push(rows.len());
    }
    let (mut order, mut place) = (vec![0; n], vec![0; n]);
    let mut memory = MemBuffer::new(amd::order_maybe_unsorted_scratch::<usize>(n, rows.len()));
    amd::order_maybe_unsorted(
        &mut order,
        &mut place,
        SymbolicSparseColMatRef::new_checked(n, n, &starts, None, &rows),
        Default::default(),
        MemStack::new(&mut memory),
    )
    .ok()?;
    Some(order)
}
