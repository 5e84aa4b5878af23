//! Which directions of motion the seen surface determines (Theorem 3).
//!
//! Thesis: Theorem 3: a closed surface lets a motion go unseen if and only if it has a rotation
//! axis. For a camera that sees a part only, any rigid motion that slides this part on itself is
//! unseen: three directions for a plane or a sphere, two for a cylinder, one for a corridor.

use crate::direction_name::{direction_name, simplest_basis};
use nalgebra::{Matrix6, SymmetricEigen, Vector6};
use std::fmt;

/// A direction of motion that is poorly determined or not at all. Its `Display` is its name with
/// its standard deviation, such as `translation along (1.00, 0.00, 0.00), 0.020 m/s`.
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

impl WeakDirection {
    /// In words: `translation along (..)`, `rotation about (..)` or a screw, in the camera's frame.
    pub fn name(&self) -> String {
        direction_name(&self.direction).map_or_else(
            || format!("direction {:?}", self.direction.as_slice()),
            |name| name.to_string(),
        )
    }
}

impl fmt::Display for WeakDirection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {:.3} m/s", self.name(), self.std_m_s)?;
        if !self.estimated {
            write!(f, " (not estimated)")?;
        }
        Ok(())
    }
}

/// What a direction must have to be estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cut {
    /// Share of the best determined direction: square root of the eigenvalues' ratio.
    pub score: f64,
    /// Eigenvalue of the normal matrix, rotations scaled by the mean range.
    pub eigenvalue: f64,
}

impl Cut {
    /// By the score alone.
    pub fn of_score(score: f64) -> Self {
        Self {
            score,
            eigenvalue: 0.0,
        }
    }
}

/// Eigenvalues and directions of a normal matrix, rotations scaled by the mean range.
#[derive(Clone, Debug)]
pub struct Spectrum {
    /// Increasing.
    values: [f64; 6],
    /// Scaled units: `[L omega, v]`.
    vectors: [Vector6<f64>; 6],
    range_m: f64,
    /// What directions are compared with: the largest eigenvalue of what the images tell. A precise
    /// prior must not make all that they tell look like nothing.
    best: f64,
}

impl Spectrum {
    /// Of `normal`, which may hold more than `images`, the part that the images tell.
    pub fn with_prior(normal: &Matrix6<f64>, images: &Matrix6<f64>, range_m: f64) -> Self {
        let unscale = diagonal(1.0 / range_m);
        let best = (unscale * images * unscale).symmetric_eigenvalues().max();
        Self {
            best,
            ..Self::new(normal, range_m)
        }
    }

    /// Of the normal matrix of a solve, rotations scaled by the scene's mean range, metres.
    pub fn new(normal: &Matrix6<f64>, range_m: f64) -> Self {
        let unscale = diagonal(1.0 / range_m);
        let eigen = SymmetricEigen::new(unscale * normal * unscale);
        let mut order = [0, 1, 2, 3, 4, 5];
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        Self {
            values: order.map(|i| eigen.eigenvalues[i].max(0.0)),
            vectors: order.map(|i| eigen.eigenvectors.column(i).into_owned()),
            range_m,
            best: eigen.eigenvalues[order[5]],
        }
    }

    /// Square root of smallest over largest eigenvalue, 0 to 1.
    pub fn score(&self) -> f64 {
        self.score_of(0)
    }

    fn score_of(&self, i: usize) -> f64 {
        self.score_of_value(self.values[i])
    }

    /// Square root of a value over the best one, 0 to 1.
    fn score_of_value(&self, value: f64) -> f64 {
        if self.best > 0.0 {
            (value / self.best).sqrt().min(1.0)
        } else {
            0.0
        }
    }

    /// Solves `normal x = right`; along directions that `cut` leaves out, x is the prior's.
    ///
    /// `normal` may weigh the rows more sharply than the matrix of the spectrum does: the spectrum
    /// says what can be seen through the noise, `normal` what was seen.
    pub fn solve(
        &self,
        normal: &Matrix6<f64>,
        right: &Vector6<f64>,
        cut: Cut,
        prior: &Vector6<f64>,
    ) -> Vector6<f64> {
        let unscale = diagonal(1.0 / self.range_m);
        let mut scaled = diagonal(self.range_m) * prior;
        for vector in self.seen(cut) {
            scaled -= vector * vector.dot(&scaled);
        }
        let left_over = unscale * (right - normal * (unscale * scaled));
        unscale * (self.inverse_of_seen(normal, cut) * left_over + scaled)
    }

    /// Covariance of the solution: `variance` over the normal matrix, and `unseen_std` squared
    /// along directions that `cut` leaves out.
    pub fn covariance(
        &self,
        normal: &Matrix6<f64>,
        variance: f64,
        cut: Cut,
        unseen_std: f64,
    ) -> Matrix6<f64> {
        let mut scaled = self.inverse_of_seen(normal, cut) * variance;
        for vector in self.vectors.iter().take(6 - self.seen(cut).len()) {
            scaled += vector * vector.transpose() * (unseen_std * unseen_std);
        }
        let unscale = diagonal(1.0 / self.range_m);
        unscale * scaled * unscale
    }

    /// The directions that are determined: the last ones, as the eigenvalues increase.
    fn seen(&self, cut: Cut) -> &[Vector6<f64>] {
        let lacks =
            |&i: &usize| self.score_of(i) < cut.score || self.values[i] <= cut.eigenvalue.max(0.0);
        let unseen = (0..6).take_while(lacks);
        &self.vectors[unseen.count()..]
    }

    /// Inverse of the scaled normal matrix within the directions that are determined, zero beyond.
    fn inverse_of_seen(&self, normal: &Matrix6<f64>, cut: Cut) -> Matrix6<f64> {
        let unscale = diagonal(1.0 / self.range_m);
        let normal = unscale * normal * unscale;
        let seen = self.seen(cut);
        // Unit entries stand in for the directions left out, so that the matrix stays 6x6.
        let mut within = Matrix6::identity();
        let mut basis = Matrix6::zeros();
        for (i, a) in seen.iter().enumerate() {
            basis.set_column(i, a);
            for (j, b) in seen.iter().enumerate() {
                within[(i, j)] = a.dot(&(normal * b));
            }
        }
        match within.cholesky() {
            Some(factor) => basis * factor.inverse() * basis.transpose(),
            None => Matrix6::repeat(f64::NAN), // no solution: the caller looks for finite numbers
        }
    }

    /// How many directions are estimated.
    pub fn rank(&self, cut: Cut) -> usize {
        self.seen(cut).len()
    }

    /// The directions whose score is below `weak` or that `cut` leaves out, with their standard
    /// deviation in `covariance`. Those left out come first, in the basis that has the most
    /// translations: where several motions go unseen together the eigenvectors are any mixture of
    /// them, which has no name.
    pub fn weak_directions(
        &self,
        covariance: &Matrix6<f64>,
        weak: f64,
        cut: Cut,
    ) -> Vec<WeakDirection> {
        let unseen = 6 - self.seen(cut).len();
        let poor = (unseen..6).filter(|&i| self.score_of(i) < weak);
        let mut vectors = simplest_basis(&self.vectors[..unseen]);
        vectors.extend(poor.map(|i| self.vectors[i]));
        let (scale, unscale) = (diagonal(self.range_m), diagonal(1.0 / self.range_m));
        let scaled = scale * covariance * scale;
        let direction = |(i, vector): (usize, &Vector6<f64>)| WeakDirection {
            direction: unscale * vector,
            std_m_s: vector.dot(&(scaled * vector)).sqrt(),
            score: self.score_along(vector),
            estimated: i >= unseen,
        };
        vectors.iter().enumerate().map(direction).collect()
    }

    /// Square root of the information along a scaled unit vector over the best one.
    fn score_along(&self, vector: &Vector6<f64>) -> f64 {
        let parts = self.values.iter().zip(&self.vectors);
        let along: f64 = parts.map(|(value, v)| value * v.dot(vector).powi(2)).sum();
        self.score_of_value(along)
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
    fn spectrum_solves_sharper_equations_within_what_is_seen() {
        let a = Matrix6::from_fn(|i, j| ((3 * i + 5 * j * j + i * j) as f64).sin());
        let sharp = a * a.transpose() + Matrix6::identity() * 0.5;
        let seen = Matrix6::from_diagonal(&Vector6::new(1.0, 1.0, 1.0, 1.0, 1.0, 0.0));
        let prior = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.7);
        let x = Vector6::new(0.1, -0.2, 0.3, 1.0, 2.0, 0.7);
        let cut = Cut {
            score: 0.1,
            eigenvalue: 0.0,
        };
        let found = Spectrum::new(&seen, 2.5).solve(&sharp, &(sharp * x), cut, &prior);
        assert!((found - x).norm() < 1e-12, "{found}");
    }

    #[test]
    fn spectrum_solves_the_normal_equations() {
        let a = Matrix6::from_fn(|i, j| ((3 * i + 5 * j * j + i * j) as f64).sin());
        let normal = a * a.transpose() + Matrix6::identity() * 0.5;
        let x = Vector6::new(0.1, -0.2, 0.3, 1.0, 2.0, -1.5);
        let spectrum = Spectrum::new(&normal, 2.5);
        let found = spectrum.solve(&normal, &(normal * x), Cut::default(), &Vector6::zeros());
        assert!((found - x).norm() < 1e-12, "{found}");
        let covariance = spectrum.covariance(&normal, 2.0, Cut::default(), 1.0);
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
        let right = Vector6::new(1.0, 2.0, 0.0, 4.0, 5.0, 6.0);
        let cut = Cut {
            score: 0.01,
            eigenvalue: 0.0,
        };
        let found = spectrum.solve(&normal, &right, cut, &prior);
        assert!(
            (found - Vector6::new(1.0, 2.0, 7.0, 4.0, 5.0, 6.0)).norm() < 1e-12,
            "{found}"
        );
        let covariance = spectrum.covariance(&normal, 1.0, cut, 3.0);
        let weak = spectrum.weak_directions(&covariance, 0.05, cut);
        assert_eq!(
            (weak.len(), weak[0].estimated, weak[0].std_m_s),
            (1, false, 3.0)
        );
        // unit length once scaled by the range of 2 m
        assert!((weak[0].direction[2].abs() - 0.5).abs() < 1e-12);
    }
}
