//! The three methods against a dense solution of a random block matrix.

use super::blocks::BlockCholesky;
use super::fill::Fill;
use super::supernodes::SupernodalCholesky;
use super::*;
use nalgebra::{DMatrix, DVector};

// a matrix of condition below 100: 1e-16 * 100, with room; conjugate gradients stop at 1e-8
const DIRECT: f64 = 1e-11;
const ITERATIVE: f64 = 1e-6;

fn sample() -> (BlockPattern, Vec<f64>, DMatrix<f64>) {
    // blocks of several sizes in a ring, and one group of three
    let sizes: Vec<usize> = (0..40).map(|b| [6, 6, 3, 7][b % 4]).collect();
    let (mut starts, mut members) = (vec![0], Vec::new());
    for b in 0..40_u32 {
        members.extend([b, (b + 1) % 40]);
        starts.push(members.len());
    }
    members.extend([3, 17, 31]);
    starts.push(members.len());
    let pattern = BlockPattern::from_groups(sizes, &starts, &members);
    let mut values = vec![0.0; pattern.len()];
    let mut dense = DMatrix::zeros(pattern.dimension(), pattern.dimension());
    let mut seed = 1_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (seed >> 33) as f64 / f64::from(u32::MAX) - 0.25
    };
    for column in 0..pattern.blocks() {
        for (row, offset) in pattern.column(column) {
            for c in 0..pattern.size(column) {
                for r in 0..pattern.size(row) {
                    let (i, j) = (pattern.start(row) + r, pattern.start(column) + c);
                    let value = if i == j { 20.0 } else { random() };
                    let mirrored = row == column && r < c;
                    let value = if mirrored { dense[(i, j)] } else { value };
                    values[offset + c * pattern.size(row) + r] = value;
                    (dense[(i, j)], dense[(j, i)]) = (value, value);
                }
            }
        }
    }
    (pattern, values, dense)
}

#[test]
fn solution_of_every_method_equals_dense_solution() {
    let (pattern, values, dense) = sample();
    let b = DVector::from_fn(pattern.dimension(), |i, _| (i as f64 * 0.7).sin());
    let expected = dense.cholesky().unwrap().solve(&b);
    for (kind, tolerance) in [
        (LinearSolver::Dense, DIRECT),
        (LinearSolver::Sparse, DIRECT),
        (LinearSolver::Iterative, ITERATIVE),
    ] {
        let mut solver = BlockSolver::new(&pattern, kind);
        assert_eq!(solver.kind(), kind);
        assert!(solver.factor(&pattern, &values));
        let mut x = b.clone();
        assert!(solver.solve(&pattern, &values, x.as_mut_slice()));
        assert!((x - &expected).norm() < tolerance, "{kind:?}");
    }
}

#[test]
fn factors_by_blocks_and_by_panels_solve_the_same() {
    let (pattern, values, dense) = sample();
    let b = DVector::from_fn(pattern.dimension(), |i, _| (i as f64 * 0.7).sin());
    let expected = dense.cholesky().unwrap().solve(&b);
    // any order will do; this one fills more than that of the solver
    let order: Vec<usize> = (0..pattern.blocks()).map(|k| (7 * k) % 40).collect();
    let fill = Fill::new(&pattern, &order).unwrap();
    let mut by_blocks = BlockCholesky::new(&pattern, fill);
    let mut by_panels = SupernodalCholesky::new(&pattern, &order).unwrap();
    assert!(by_blocks.factor(&values) && by_panels.factor(&values));
    let (mut x, mut y) = (b.clone(), b);
    by_blocks.solve(x.as_mut_slice());
    by_panels.solve(y.as_mut_slice());
    assert!((x - &expected).norm() < DIRECT && (y - expected).norm() < DIRECT);
}

#[test]
fn matrix_that_is_not_positive_is_refused() {
    let (pattern, mut values, _) = sample();
    values[pattern.diagonal(5)] = -1.0;
    for kind in [
        LinearSolver::Dense,
        LinearSolver::Sparse,
        LinearSolver::Iterative,
    ] {
        assert!(
            !BlockSolver::new(&pattern, kind).factor(&pattern, &values),
            "{kind:?}"
        );
    }
    let order: Vec<usize> = (0..pattern.blocks()).collect();
    let mut by_panels = SupernodalCholesky::new(&pattern, &order).unwrap();
    assert!(!by_panels.factor(&values));
}

#[test]
fn product_equals_dense_product() {
    let (pattern, values, dense) = sample();
    let x = DVector::from_fn(pattern.dimension(), |i, _| (i as f64).cos());
    let mut y = DVector::zeros(pattern.dimension());
    pattern.multiply(&values, x.as_slice(), y.as_mut_slice());
    assert!((y - dense * x).norm() < DIRECT);
}
