//! Conjugate gradients, preconditioned by the inverses of the diagonal blocks.

use super::BlockPattern;
use nalgebra::{DMatrix, DMatrixViewMut, DVector};

/// Residual norm, relative to that of the right side, at which a solution is good enough for a
/// damped step: errors of the step enter the cost squared.
const TOLERANCE: f64 = 1e-8;

pub(super) struct ConjugateGradients {
    /// Inverses of the diagonal blocks, by columns, one after the other.
    inverses: Vec<f64>,
    inverse_starts: Vec<usize>,
    x: DVector<f64>,
    residual: DVector<f64>,
    direction: DVector<f64>,
    image: DVector<f64>,
    scaled: DVector<f64>,
}

impl ConjugateGradients {
    pub fn new(pattern: &BlockPattern) -> Self {
        let n = pattern.dimension();
        let mut inverse_starts = vec![0];
        let mut sum = 0;
        for block in 0..pattern.blocks() {
            sum += pattern.size(block) * pattern.size(block);
            inverse_starts.push(sum);
        }
        Self {
            inverses: vec![0.0; sum],
            inverse_starts,
            x: DVector::zeros(n),
            residual: DVector::zeros(n),
            direction: DVector::zeros(n),
            image: DVector::zeros(n),
            scaled: DVector::zeros(n),
        }
    }

    /// False where a diagonal block is not positive definite.
    pub fn precondition(&mut self, pattern: &BlockPattern, values: &[f64]) -> bool {
        for block in 0..pattern.blocks() {
            let size = pattern.size(block);
            let offset = pattern.diagonal(block);
            let matrix =
                DMatrix::from_column_slice(size, size, &values[offset..offset + size * size]);
            let Some(factor) = matrix.cholesky() else {
                return false;
            };
            let range = self.inverse_starts[block]..self.inverse_starts[block + 1];
            DMatrixViewMut::from_slice(&mut self.inverses[range], size, size)
                .copy_from(&factor.inverse());
        }
        true
    }

    fn apply(&mut self, pattern: &BlockPattern) {
        self.scaled.fill(0.0);
        for block in 0..pattern.blocks() {
            let (size, start) = (pattern.size(block), pattern.start(block));
            let inverse = &self.inverses[self.inverse_starts[block]..];
            for c in 0..size {
                for r in 0..size {
                    self.scaled[start + r] += inverse[c * size + r] * self.residual[start + c];
                }
            }
        }
    }

    pub fn solve(&mut self, pattern: &BlockPattern, values: &[f64], b: &mut [f64]) {
        self.x.fill(0.0);
        self.residual.copy_from_slice(b);
        let goal = TOLERANCE * self.residual.norm();
        self.apply(pattern);
        self.direction.copy_from(&self.scaled);
        let mut energy = self.residual.dot(&self.scaled);
        for _ in 0..pattern.dimension().max(50) {
            if self.residual.norm() <= goal {
                break;
            }
            pattern.multiply(values, self.direction.as_slice(), self.image.as_mut_slice());
            let curvature = self.direction.dot(&self.image);
            if curvature.is_nan() || curvature <= 0.0 {
                break;
            }
            let along = energy / curvature;
            self.x.axpy(along, &self.direction, 1.0);
            self.residual.axpy(-along, &self.image, 1.0);
            self.apply(pattern);
            let next = self.residual.dot(&self.scaled);
            self.direction.axpy(1.0, &self.scaled, next / energy);
            energy = next;
        }
        b.copy_from_slice(self.x.as_slice());
    }
}
