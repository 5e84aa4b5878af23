//! Which directions of motion the seen surface determines (Theorem 3).
//!
//! Thesis: Theorem 3: a closed surface lets a motion go unseen if and only if it has a rotation
//! axis. For a camera that sees a part only, any rigid motion that slides this part on itself is
//! unseen: three directions for a plane or a sphere, two for a cylinder, one for a corridor.

use nalgebra::{Matrix6, SymmetricEigen, Vector6};

/// A direction of motion that is poorly determined or not at all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeakDirection {
    /// `[omega, v]` of unit length once omega is multiplied by the mean range (metres): m/s.
    pub direction: Vector6<f64>,
    /// Standard deviation of the estimate along it, m/s.
    pub std_m_s: f64,
    /// Its share of the best determined direction: square root of the eigenvalues' ratio.
    pub score: f64,
    /// False where the motion along it was not estimated but taken from the prior.
    pub estimated: bool,
}

/// Eigenvalues and directions of a normal matrix, rotations scaled by the mean range.
#[derive(Clone, Debug)]
pub(crate) struct Spectrum {
    /// Increasing.
    values: [f64; 6],
    /// Scaled units: `[L omega, v]`.
    vectors: [Vector6<f64>; 6],
    range_m: f64,
}

impl Spectrum {
    pub(crate) fn new(normal: &Matrix6<f64>, range_m: f64) -> Self {
        let unscale = diagonal(1.0 / range_m);
        let eigen = SymmetricEigen::new(unscale * normal * unscale);
        let mut order = [0, 1, 2, 3, 4, 5];
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        Self {
            values: order.map(|i| eigen.eigenvalues[i].max(0.0)),
            vectors: order.map(|i| eigen.eigenvectors.column(i).into_owned()),
            range_m,
        }
    }

    /// Square root of smallest over largest eigenvalue, 0 to 1.
    pub(crate) fn score(&self) -> f64 {
        self.score_of(0)
    }

    fn score_of(&self, i: usize) -> f64 {
        if self.values[5] > 0.0 {
            (self.values[i] / self.values[5]).sqrt()
        } else {
            0.0
        }
    }

    /// Solves `normal x = right`; along directions whose score is below `limit`, x is the prior's.
    pub(crate) fn solve(
        &self,
        right: &Vector6<f64>,
        limit: f64,
        prior: &Vector6<f64>,
    ) -> Vector6<f64> {
        let right = diagonal(1.0 / self.range_m) * right;
        let prior = diagonal(self.range_m) * prior;
        let mut scaled = Vector6::zeros();
        for (i, (value, vector)) in self.values.iter().zip(&self.vectors).enumerate() {
            let seen = self.score_of(i) >= limit && *value > 0.0;
            scaled += vector
                * if seen {
                    vector.dot(&right) / value
                } else {
                    vector.dot(&prior)
                };
        }
        diagonal(1.0 / self.range_m) * scaled
    }

    /// Covariance of the solution: `variance` over the eigenvalues, `unseen_std` squared along
    /// directions below `limit`.
    pub(crate) fn covariance(&self, variance: f64, limit: f64, unseen_std: f64) -> Matrix6<f64> {
        let mut scaled = Matrix6::zeros();
        for (i, vector) in self.vectors.iter().enumerate() {
            let std = self.std_of(i, variance, limit, unseen_std);
            scaled += vector * vector.transpose() * (std * std);
        }
        let unscale = diagonal(1.0 / self.range_m);
        unscale * scaled * unscale
    }

    /// The directions whose score is below `weak`.
    pub(crate) fn weak_directions(
        &self,
        weak: f64,
        variance: f64,
        limit: f64,
        unseen_std: f64,
    ) -> Vec<WeakDirection> {
        (0..6)
            .filter(|&i| self.score_of(i) < weak.max(limit))
            .map(|i| WeakDirection {
                direction: diagonal(1.0 / self.range_m) * self.vectors[i],
                std_m_s: self.std_of(i, variance, limit, unseen_std),
                score: self.score_of(i),
                estimated: self.score_of(i) >= limit,
            })
            .collect()
    }

    fn std_of(&self, i: usize, variance: f64, limit: f64, unseen_std: f64) -> f64 {
        if self.score_of(i) >= limit && self.values[i] > 0.0 {
            (variance / self.values[i]).sqrt()
        } else {
            unseen_std
        }
    }
}

/// The scaling `[omega, v] -> [s omega, v]`.
fn diagonal(s: f64) -> Matrix6<f64> {
    Matrix6::from_diagonal(&Vector6::new(s, s, s, 1.0, 1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spectrum_solves_the_normal_equations() {
        let a = Matrix6::from_fn(|i, j| ((3 * i + 5 * j * j + i * j) as f64).sin());
        let normal = a * a.transpose() + Matrix6::identity() * 0.5;
        let x = Vector6::new(0.1, -0.2, 0.3, 1.0, 2.0, -1.5);
        let spectrum = Spectrum::new(&normal, 2.5);
        let found = spectrum.solve(&(normal * x), 0.0, &Vector6::zeros());
        assert!((found - x).norm() < 1e-12, "{found}");
        let covariance = spectrum.covariance(2.0, 0.0, 1.0);
        let identity = covariance * normal / 2.0;
        assert!(
            (identity - Matrix6::identity()).norm() < 1e-10,
            "{identity}"
        );
    }

    #[test]
    fn spectrum_unseen_direction_takes_the_prior() {
        let normal = Matrix6::from_diagonal(&Vector6::new(1.0, 1.0, 0.0, 1.0, 1.0, 1.0));
        let spectrum = Spectrum::new(&normal, 2.0);
        let prior = Vector6::repeat(7.0);
        let found = spectrum.solve(&Vector6::new(1.0, 2.0, 0.0, 4.0, 5.0, 6.0), 0.01, &prior);
        assert!(
            (found - Vector6::new(1.0, 2.0, 7.0, 4.0, 5.0, 6.0)).norm() < 1e-12,
            "{found}"
        );
        let weak = spectrum.weak_directions(0.05, 1.0, 0.01, 3.0);
        assert_eq!(
            (weak.len(), weak[0].estimated, weak[0].std_m_s),
            (1, false, 3.0)
        );
        // unit length once scaled by the range of 2 m
        assert!((weak[0].direction[2].abs() - 0.5).abs() < 1e-12);
    }
}
