//! Symmetric positive definite block systems: their pattern and three ways to solve them.

mod blocks;
mod dense;
mod dissection;
mod fill;
mod kernel;
mod normal_equations;
mod pattern;
mod pcg;
mod sparse;
mod supernodes;

pub(crate) use normal_equations::NormalEquations;
pub(crate) use pattern::BlockPattern;

use dense::DenseCholesky;
use pcg::ConjugateGradients;
use sparse::SparseCholesky;

/// How the reduced system is solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum LinearSolver {
    /// Chosen by the size and the fill of the system.
    #[default]
    Auto,
    /// Dense Cholesky.
    Dense,
    /// Sparse Cholesky with a fill-reducing ordering.
    Sparse,
    /// Conjugate gradients, preconditioned by the diagonal blocks.
    Iterative,
}

/// Up to this many unknowns a dense factorisation takes about a millisecond.
const SMALL: usize = 240;
/// A sparse factor with more than this share of a dense one is not worth its indices.
const FILL: f64 = 0.5;
/// Entries of the largest factor that is made: 2 GiB.
const MAX_FACTOR: usize = 1 << 28;

enum Method {
    Dense(DenseCholesky),
    Sparse(Box<SparseCholesky>),
    Iterative(ConjugateGradients),
}

/// A solver for matrices of one pattern; it allocates only when it is made.
pub(crate) struct BlockSolver {
    method: Method,
}

impl BlockSolver {
    pub fn new(pattern: &BlockPattern, choice: LinearSolver) -> Self {
        let n = pattern.dimension();
        let dense = |n: usize| n.saturating_mul(n) <= MAX_FACTOR;
        let method = match choice {
            LinearSolver::Dense => Method::Dense(DenseCholesky::new(n)),
            LinearSolver::Iterative => Method::Iterative(ConjugateGradients::new(pattern)),
            LinearSolver::Auto if n <= SMALL => Method::Dense(DenseCholesky::new(n)),
            LinearSolver::Sparse | LinearSolver::Auto => match SparseCholesky::new(pattern) {
                Some(sparse) if choice == LinearSolver::Sparse => Method::Sparse(Box::new(sparse)),
                Some(sparse) => {
                    let full = 0.5 * (n as f64) * (n as f64);
                    if sparse.factor_len() as f64 <= FILL * full && sparse.factor_len() < MAX_FACTOR
                    {
                        Method::Sparse(Box::new(sparse))
                    } else if dense(n) {
                        Method::Dense(DenseCholesky::new(n))
                    } else {
                        Method::Iterative(ConjugateGradients::new(pattern))
                    }
                }
                None if dense(n) => Method::Dense(DenseCholesky::new(n)),
                None => Method::Iterative(ConjugateGradients::new(pattern)),
            },
        };
        Self { method }
    }

    /// What it is.
    pub fn kind(&self) -> LinearSolver {
        match self.method {
            Method::Dense(_) => LinearSolver::Dense,
            Method::Sparse(_) => LinearSolver::Sparse,
            Method::Iterative(_) => LinearSolver::Iterative,
        }
    }

    /// Take the matrix with the blocks `values`; false where it is not positive definite.
    pub fn factor(&mut self, pattern: &BlockPattern, values: &[f64]) -> bool {
        match &mut self.method {
            Method::Dense(solver) => solver.factor(pattern, values),
            Method::Sparse(solver) => solver.factor(values),
            Method::Iterative(solver) => solver.precondition(pattern, values),
        }
    }

    /// Solve in place with the matrix last factored, whose blocks are `values`; false where the
    /// solution is not a finite vector.
    pub fn solve(&mut self, pattern: &BlockPattern, values: &[f64], x: &mut [f64]) -> bool {
        match &mut self.method {
            Method::Dense(solver) => solver.solve(x),
            Method::Sparse(solver) => solver.solve(x),
            Method::Iterative(solver) => solver.solve(pattern, values, x),
        }
        x.iter().all(|v| v.is_finite())
    }
}

#[cfg(test)]
mod tests;
