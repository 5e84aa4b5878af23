//! Least squares over the domains, and the covariance of section 6.4.

use super::balance::{Balance, CellBalance};
use super::config::{RowWeights, ThesisConfig};
use nalgebra::{Matrix6, Vector6};
use sphereflow_alignment::observability::{Cut, Spectrum};
use sphereflow_core::statistics::mad_sigma_mut;

/// One domain: `rate = coefficients . [omega, v]`.
#[derive(Clone, Copy, Debug)]
struct Row {
    rate: f64,
    coefficients: Vector6<f64>,
    /// What a change of the inverse range by 1/m over the whole domain does to its volume.
    per_inverse: f64,
}

/// What the least squares give.
#[derive(Clone, Debug)]
pub(crate) struct Solution {
    pub(crate) twist: Vector6<f64>,
    pub(crate) covariance: Matrix6<f64>,
    /// What the domains let see through equal noise of the inverse range.
    pub(crate) spectrum: Spectrum,
    /// Median residual as inverse range over the expected noise.
    pub(crate) scale: f64,
    /// The same of a camera at rest.
    pub(crate) scale_at_rest: f64,
    pub(crate) mean_range_m: f64,
}

/// The rows of the domains without a hole.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows {
    rows: Vec<Row>,
    sorted: Vec<f64>,
    mean_range_m: f64,
}

impl Rows {
    /// Takes the domains without a hole; returns how many there are.
    pub(crate) fn take(&mut self, balance: &Balance, dt_s: f64) -> usize {
        self.rows.clear();
        let mut range_sum = 0.0;
        let rows = &mut self.rows;
        balance.domains().for_each(|cells| {
            let sum = cells.map(|i| balance.cells[i]).reduce(plus);
            let Some(sum) = sum.filter(|s| s.change.is_finite() && s.volume > 0.0) else {
                return;
            };
            let range = (sum.volume / sum.area).cbrt();
            if !(range.is_finite() && sum.coefficients.iter().all(|c| c.is_finite())) {
                return;
            }
            range_sum += range;
            rows.push(Row {
                rate: sum.change / dt_s,
                coefficients: sum.coefficients,
                per_inverse: 3.0 * range.powi(4) * sum.area,
            });
        });
        self.mean_range_m = range_sum / self.rows.len().max(1) as f64;
        self.rows.len()
    }

    /// The twist that leaves the smallest sum of squares, directions that nothing determines being
    /// zero (the pseudo-inverse), and its covariance.
    ///
    /// Thesis: section 6.4: "the covariance of the result is directly encrypted in the
    /// pseudo-inverse of the linear system weighted by the residuals": `A+ diag(r^2) A+^T`, with
    /// the factor m / (m - 6) for the six parameters that the residuals were made small with.
    pub(crate) fn solve(&mut self, config: &ThesisConfig, dt_s: f64) -> Solution {
        let (mut normal, mut seen) = (Matrix6::zeros(), Matrix6::zeros());
        let mut right = Vector6::zeros();
        for row in &self.rows {
            let square = row.coefficients * row.coefficients.transpose();
            let weight = row.weight(config.weights);
            normal += square * weight;
            right += row.coefficients * (weight * row.rate);
            seen += square / (row.per_inverse * row.per_inverse);
        }
        let limits = &config.limits;
        let limit = Cut::of_score(limits.unobservable_score);
        let spectrum = Spectrum::new(&seen, self.mean_range_m);
        let twist = spectrum.solve(&normal, &right, limit, &Vector6::zeros());
        let mut squares = Matrix6::zeros();
        for row in &self.rows {
            let weighted = row.weight(config.weights) * row.residual(&twist);
            squares += row.coefficients * row.coefficients.transpose() * (weighted * weighted);
        }
        let rows = self.rows.len() as f64;
        let inverse = spectrum.covariance(&normal, 1.0, limit, 0.0);
        let unseen = spectrum.covariance(&normal, 0.0, limit, limits.unobservable_std_m_s);
        let noise = limits.domain_noise / dt_s;
        Solution {
            twist,
            covariance: inverse * squares * inverse * (rows / (rows - 6.0)) + unseen,
            spectrum,
            scale: self.scale(&twist) / noise,
            scale_at_rest: self.scale(&Vector6::zeros()) / noise,
            mean_range_m: self.mean_range_m,
        }
    }

    /// Median residual as inverse range, 1/(m s), as a standard deviation.
    fn scale(&mut self, twist: &Vector6<f64>) -> f64 {
        self.sorted.clear();
        let residuals = self.rows.iter();
        self.sorted
            .extend(residuals.map(|row| row.residual(twist) / row.per_inverse));
        mad_sigma_mut(&mut self.sorted).unwrap_or(0.0)
    }
}

impl Row {
    fn residual(&self, twist: &Vector6<f64>) -> f64 {
        self.rate - self.coefficients.dot(twist)
    }

    fn weight(&self, weights: RowWeights) -> f64 {
        match weights {
            RowWeights::Equal => 1.0,
            RowWeights::DomainNoise => 1.0 / (self.per_inverse * self.per_inverse),
        }
    }
}

/// Two cells together: the edges between them cancel, having been added with both signs.
fn plus(a: CellBalance, b: CellBalance) -> CellBalance {
    CellBalance {
        change: a.change + b.change,
        coefficients: a.coefficients + b.coefficients,
        volume: a.volume + b.volume,
        area: a.area + b.area,
    }
}
