//! All pairs together: normal equations with a prior, covariance, and what was observable.

use super::pair_fit::Normal;
use super::parameters::Unknowns;
use super::result::{CalibratedParameter, HeldCombination};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Parts of the recording that are left out in turn.
const PARTS: usize = 8;
/// Parameters that make up a named combination.
const NAMED: usize = 4;
/// Share of the largest one below which a parameter is not named.
const NAMED_SHARE: f64 = 0.3;

/// The sums of all pairs, in units of the prior: the unknowns are `value / prior_std`, so that the
/// prior's information is the identity.
#[derive(Clone, Debug)]
pub(super) struct System {
    parts: Vec<Normal>,
    scale: DVector<f64>,
}

impl System {
    /// Consecutive pairs make a part.
    pub(super) fn new(unknowns: &Unknowns, normals: &[Normal]) -> Self {
        let scale = unknowns.prior_std();
        let n = scale.len();
        let diagonal = DMatrix::from_diagonal(&scale);
        let length = normals.len().div_ceil(PARTS).max(1);
        let parts = normals.chunks(length).map(|normals| {
            let mut sum = Normal {
                information: DMatrix::zeros(n, n),
                right: DVector::zeros(n),
            };
            for normal in normals {
                sum.information += &diagonal * &normal.information * &diagonal;
                sum.right += &diagonal * &normal.right;
            }
            sum
        });
        Self {
            parts: parts.collect(),
            scale,
        }
    }

    /// Step of the values from where they are, `away` from the prior's mean, with the information
    /// divided by `inflation` squared.
    pub(super) fn step(&self, away: &DVector<f64>, inflation: f64) -> DVector<f64> {
        let away = away.component_div(&self.scale);
        self.solution(None, &away, inflation)
            .component_mul(&self.scale)
    }

    fn sum(&self, without: Option<usize>) -> Normal {
        let n = self.scale.len();
        let mut sum = Normal {
            information: DMatrix::zeros(n, n),
            right: DVector::zeros(n),
        };
        for (k, part) in self.parts.iter().enumerate() {
            if Some(k) != without {
                sum.information += &part.information;
                sum.right += &part.right;
            }
        }
        sum
    }

    fn solution(
        &self,
        without: Option<usize>,
        away: &DVector<f64>,
        inflation: f64,
    ) -> DVector<f64> {
        let sum = self.sum(without);
        inverse(&sum.information, inflation) * (sum.right / inflation.powi(2) - away)
    }

    /// How much larger the standard deviations are than the residuals of independent domains would
    /// make them: delete-a-group jackknife over the parts, mean over what was observed.
    pub(super) fn inflation(&self, away: &DVector<f64>) -> f64 {
        let count = self.parts.len();
        if count < 2 {
            return 1.0;
        }
        let away = away.component_div(&self.scale);
        let left_out: Vec<DVector<f64>> = (0..count)
            .map(|k| self.solution(Some(k), &away, 1.0))
            .collect();
        let mean = left_out
            .iter()
            .fold(DVector::zeros(self.scale.len()), |sum, v| sum + v)
            / count as f64;
        let eigen = SymmetricEigen::new(self.sum(None).information);
        let (mut ratio, mut observed) = (0.0, 0.0);
        for (value, vector) in eigen
            .eigenvalues
            .iter()
            .zip(eigen.eigenvectors.column_iter())
        {
            if *value < 1.0 {
                continue;
            }
            let spread: f64 = left_out
                .iter()
                .map(|v| vector.dot(&(v - &mean)).powi(2))
                .sum();
            let jackknife = spread * (count as f64 - 1.0) / count as f64;
            ratio += jackknife * (1.0 + value);
            observed += 1.0;
        }
        if observed > 0.0 {
            (ratio / observed).sqrt().max(1.0)
        } else {
            1.0
        }
    }

    /// Covariance of the values, with the information divided by `inflation` squared.
    pub(super) fn covariance(&self, inflation: f64) -> DMatrix<f64> {
        let scale = DMatrix::from_diagonal(&self.scale);
        &scale * inverse(&self.sum(None).information, inflation) * &scale
    }

    /// Directions whose standard deviation stayed above `share` of the prior's, the worst first;
    /// and whether there is any below.
    pub(super) fn held(
        &self,
        unknowns: &Unknowns,
        inflation: f64,
        share: f64,
    ) -> (Vec<HeldCombination>, bool) {
        let eigen = SymmetricEigen::new(self.sum(None).information);
        let mut held = Vec::new();
        for (value, vector) in eigen
            .eigenvalues
            .iter()
            .zip(eigen.eigenvectors.column_iter())
        {
            let std_share = (1.0 + value.max(0.0) / inflation.powi(2)).powf(-0.5);
            if std_share <= share {
                continue;
            }
            let named = unknowns.all.iter().map(|u| u.name.clone());
            let mut shares: Vec<(String, f64)> = named.zip(vector.iter().copied()).collect();
            shares.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
            let largest = shares.first().map_or(0.0, |s| s.1.abs());
            shares.truncate(NAMED);
            shares.retain(|(_, value)| value.abs() >= NAMED_SHARE * largest);
            held.push(HeldCombination { std_share, shares });
        }
        held.sort_by(|a, b| b.std_share.total_cmp(&a.std_share));
        let any_seen = held.len() < self.scale.len();
        (held, any_seen)
    }
}

/// Inverse of `information / inflation^2 + 1`, the prior being the identity.
fn inverse(information: &DMatrix<f64>, inflation: f64) -> DMatrix<f64> {
    let n = information.nrows();
    let sum = information / inflation.powi(2) + DMatrix::identity(n, n);
    match sum.cholesky() {
        Some(cholesky) => cholesky.inverse(),
        None => DMatrix::identity(n, n), // rounding only: the sum is positive definite
    }
}

/// The parameters with their standard deviations.
pub(super) fn parameters(
    unknowns: &Unknowns,
    values: &DVector<f64>,
    covariance: &DMatrix<f64>,
    share: f64,
) -> Vec<CalibratedParameter> {
    let each = unknowns.all.iter().zip(values.iter()).enumerate();
    each.map(|(i, (unknown, &value))| {
        let std = covariance
            .get((i, i))
            .map_or(unknown.prior_std, |v| v.max(0.0).sqrt());
        CalibratedParameter {
            name: unknown.name.clone(),
            value,
            std,
            prior_std: unknown.prior_std,
            observable: std <= share * unknown.prior_std,
        }
    })
    .collect()
}
