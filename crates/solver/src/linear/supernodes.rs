//! Sparse Cholesky factorisation by dense panels (faer), for factors that fill.

use super::BlockPattern;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{Conj, MatMut, Par, Side};

/// Factors of more numbers than this are made in parts, always of the same number, so that the
/// result does not depend on the number of threads.
const PARALLEL: usize = 1_500_000;
const PARTS: usize = 4;
pub(super) struct SupernodalCholesky {
    structure: SymbolicSparseColMat<usize>,
    /// For each number of the compressed columns, its place in the blocks.
    source: Vec<usize>,
    values: Vec<f64>,
    symbolic: SymbolicCholesky<usize>,
    factor: Vec<f64>,
    memory: MemBuffer,
    par: Par,
}

impl SupernodalCholesky {
    /// With the blocks eliminated in this order; `None` where the symbolic factorisation fails (too
    /// large for the memory).
    pub fn new(pattern: &BlockPattern, order: &[usize]) -> Option<Self> {
        let (structure, source) = columns(pattern);
        let symbolic = symbolic(pattern, &structure, order)?;
        let par = if symbolic.len_val() > PARALLEL {
            Par::rayon(PARTS)
        } else {
            Par::Seq
        };
        let need = symbolic
            .factorize_numeric_llt_scratch::<f64>(par, Default::default())
            .or(symbolic.solve_in_place_scratch::<f64>(1, par));
        Some(Self {
            values: vec![0.0; source.len()],
            factor: vec![0.0; symbolic.len_val()],
            memory: MemBuffer::new(need),
            structure,
            source,
            symbolic,
            par,
        })
    }

    /// Numbers in the factor.
    pub fn factor_len(&self) -> usize {
        self.factor.len()
    }

    pub fn factor(&mut self, values: &[f64]) -> bool {
        for (value, &source) in self.values.iter_mut().zip(&self.source) {
            *value = values[source];
        }
        self.symbolic
            .factorize_numeric_llt(
                &mut self.factor,
                SparseColMatRef::new(self.structure.as_ref(), &self.values),
                Side::Lower,
                Default::default(),
                self.par,
                MemStack::new(&mut self.memory),
                Default::default(),
            )
            .is_ok()
    }

    pub fn solve(&mut self, x: &mut [f64]) {
        let n = x.len();
        LltRef::new(&self.symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, n, 1),
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
    }
}

/// Symbolic factorisation with the blocks eliminated in this order.
fn symbolic(
    pattern: &BlockPattern,
    structure: &SymbolicSparseColMat<usize>,
    order: &[usize],
) -> Option<SymbolicCholesky<usize>> {
    let mut forward = Vec::with_capacity(pattern.dimension());
    for &block in order {
        forward.extend(pattern.start(block)..pattern.start(block) + pattern.size(block));
    }
    let mut inverse = vec![0; forward.len()];
    for (to, &from) in forward.iter().enumerate() {
        inverse[from] = to;
    }
    let order = PermRef::new_checked(&forward, &inverse, pattern.dimension());
    factorize_symbolic_cholesky(
        structure.as_ref(),
        Side::Lower,
        SymmetricOrdering::Custom(order),
        CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        },
    )
    .ok()
}

/// The lower triangle in compressed columns, and where each of its numbers is in the blocks.
fn columns(pattern: &BlockPattern) -> (SymbolicSparseColMat<usize>, Vec<usize>) {
    let (mut starts, mut rows, mut source) = (vec![0], Vec::new(), Vec::new());
    for column in 0..pattern.blocks() {
        for c in 0..pattern.size(column) {
            for (row, offset) in pattern.column(column) {
                let height = pattern.size(row);
                let first = if row == column { c } else { 0 };
                for r in first..height {
                    rows.push(pattern.start(row) + r);
                    source.push(offset + c * height + r);
                }
            }
            starts.push(rows.len());
        }
    }
    let n = pattern.dimension();
    (
        SymbolicSparseColMat::new_checked(n, n, starts, None, rows),
        source,
    )
}
