//! Conjugate gradients, preconditioned by the inverses of the diagonal blocks.

use super::BlockPattern;
use nalgebra::DVector;

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
            let range = self.inverse_starts[block]..self.inverse_starts[block + 1];
            let inverse = &mut self.inverses[range];
            inverse.copy_from_slice(&values[offset..offset + size * size]);
            if !invert(inverse, size) {
                return false;
            }
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

/// The inverse of a symmetric matrix in place, by columns; false where it is not positive definite.
fn invert(a: &mut [f64], n: usize) -> bool {
    // A = L L^T in the lower triangle
    for k in 0..n {
        let mut pivot = a[k * n + k];
        for j in 0..k {
            pivot -= a[j * n + k] * a[j * n + k];
        }
        // a NaN is not positive either
        if pivot.is_nan() || pivot <= 0.0 {
            return false;
        }
        let pivot = pivot.sqrt();
        a[k * n + k] = pivot;
        for r in k + 1..n {
            let mut sum = a[k * n + r];
            for j in 0..k {
                sum -= a[j * n + r] * a[j * n + k];
            }
            a[k * n + r] = sum / pivot;
        }
    }
    // L^-1 in its place, column by column from the last
    for c in (0..n).rev() {
        let pivot = 1.0 / a[c * n + c];
        for r in (c + 1..n).rev() {
            let sum: f64 = (c + 1..=r).map(|k| a[k * n + r] * a[c * n + k]).sum();
            a[c * n + r] = -sum * pivot;
        }
        a[c * n + c] = pivot;
    }
    // L^-T L^-1 into the upper triangle with the diagonal, then down
    for c in 0..n {
        for r in 0..=c {
            let sum: f64 = (c..n).map(|k| a[r * n + k] * a[c * n + k]).sum();
            a[c * n + r] = sum;
        }
    }
    for c in 0..n {
        for r in c + 1..n {
            a[c * n + r] = a[r * n + c];
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    #[test]
    fn inverse_in_place_times_matrix_is_identity() {
        for n in [1, 2, 3, 6, 9] {
            let a = DMatrix::from_fn(n, n, |r, c| (1.3 * r as f64 + 0.7 * c as f64).sin());
            let spd = &a * a.transpose() + DMatrix::identity(n, n);
            let mut inverse = spd.clone();
            assert!(invert(inverse.as_mut_slice(), n));
            // rounding of a few products
            assert!(
                (inverse * spd - DMatrix::identity(n, n)).norm() < 1e-12,
                "{n}"
            );
        }
        assert!(!invert(&mut [1.0, 2.0, 2.0, 1.0], 2));
        assert!(!invert(&mut [f64::NAN], 1));
    }
}
