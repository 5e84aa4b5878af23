//! Robust losses: how much a large residual counts.

use crate::Result;
use sphereflow_core::checks::positive;

/// A loss `rho` of the squared norm `s` of a whitened residual; the cost is half the sum of `rho`.
/// Thresholds are in standard deviations. Thesis: section 8.4.2, the M-estimator.
///
/// All of them are concave in `s`, so the reweighted quadratic (weight `rho'(s)`) lies above the cost
/// and touches it at the current state: a step that lowers it lowers the cost. That is the form for
/// steps of everything together, but it is too steep along a residual that is far out: the cost's own
/// second order there is `rho' + 2 rho'' s` instead of `rho'` (Triggs et al., 2000, with their
/// correction of the Gauss-Newton matrix), zero or less for an outlier, and steps that do without it
/// converge linearly. [`Loss::flattening`] is that difference, bounded so that what is left stays
/// positive; it is used where one point alone is moved, whose damping is its own.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Loss {
    /// `rho = s`.
    #[default]
    Quadratic,
    /// Quadratic up to the threshold, linear in the norm beyond.
    Huber(f64),
    /// `rho = k^2 log(1 + s / k^2)`.
    Cauchy(f64),
    /// Tukey's biweight: `rho = k^2 / 3 (1 - (1 - s / k^2)^3)`, constant beyond the threshold.
    Tukey(f64),
}

/// Share of the weight that is left of the curvature along a residual, at least: a matrix with less
/// is singular where all residuals of a point are far out.
const CURVATURE: f64 = 0.01;

impl Loss {
    /// The loss and its derivative (the weight) at the squared norm `s`.
    #[inline]
    pub fn evaluate(&self, s: f64) -> (f64, f64) {
        match *self {
            Self::Quadratic => (s, 1.0),
            Self::Huber(k) => {
                if s <= k * k {
                    (s, 1.0)
                } else {
                    let norm = s.sqrt();
                    (2.0 * k * norm - k * k, k / norm)
                }
            }
            Self::Cauchy(k) => {
                let ratio = s / (k * k);
                (k * k * ratio.ln_1p(), 1.0 / (1.0 + ratio))
            }
            Self::Tukey(k) => {
                let k2 = k * k;
                if s <= k2 {
                    let rest = 1.0 - s / k2;
                    (k2 / 3.0 * (1.0 - rest * rest * rest), rest * rest)
                } else {
                    (k2 / 3.0, 0.0)
                }
            }
        }
    }

    /// By how much the curvature of the cost along the residual, `rho' + 2 rho'' s`, is below the
    /// weight, over `s`: `weight A^T A - flattening A^T r r^T A` is the second order of the cost (but
    /// for the residual's own curvature), kept positive. Thesis: section 8.4.2, the M-estimator.
    #[inline]
    pub fn flattening(&self, s: f64) -> f64 {
        match *self {
            Self::Quadratic => 0.0,
            Self::Huber(k) if s <= k * k => 0.0,
            Self::Huber(_) => (1.0 - CURVATURE) * self.evaluate(s).1 / s,
            Self::Cauchy(k) => {
                let (ratio, weight) = (s / (k * k), self.evaluate(s).1);
                // -2 rho'' / rho' = 2 / (k^2 + s)
                weight * (2.0 * ratio / (1.0 + ratio)).min(1.0 - CURVATURE)
                    / s.max(f64::MIN_POSITIVE)
            }
            Self::Tukey(k) => {
                let (ratio, weight) = (s / (k * k), self.evaluate(s).1);
                let share = 4.0 * ratio / (1.0 - ratio).max(f64::MIN_POSITIVE);
                weight * share.min(1.0 - CURVATURE) / s.max(f64::MIN_POSITIVE)
            }
        }
    }

    /// # Errors
    /// Where the threshold is not a positive number.
    pub fn check(&self) -> Result<()> {
        match *self {
            Self::Quadratic => Ok(()),
            Self::Huber(k) | Self::Cauchy(k) | Self::Tukey(k) => Ok(positive("loss", k)?),
        }
    }

    /// The same loss for residuals whose standard deviation is `scale` times the assumed one.
    pub fn scaled(self, scale: f64) -> Self {
        match self {
            Self::Quadratic => self,
            Self::Huber(k) => Self::Huber(k * scale),
            Self::Cauchy(k) => Self::Cauchy(k * scale),
            Self::Tukey(k) => Self::Tukey(k * scale),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOSSES: [Loss; 4] = [
        Loss::Quadratic,
        Loss::Huber(1.3),
        Loss::Cauchy(2.0),
        Loss::Tukey(4.7),
    ];

    // central differences with a step of 1e-5 are good to about 1e-10
    const DIFFERENCE: f64 = 1e-8;

    #[test]
    fn weight_is_derivative_of_loss() {
        for loss in LOSSES {
            for s in [0.01, 0.5, 1.6, 3.0, 21.0, 30.0] {
                let step = 1e-5;
                let slope = (loss.evaluate(s + step).0 - loss.evaluate(s - step).0) / (2.0 * step);
                assert!(
                    (slope - loss.evaluate(s).1).abs() < DIFFERENCE,
                    "{loss:?} {s}"
                );
            }
        }
    }

    #[test]
    fn reweighted_quadratic_lies_above_every_loss() {
        // Thesis: section 8.4.2: what makes reweighting a descent
        for loss in LOSSES {
            for s0 in [0.1, 1.0, 5.0, 25.0] {
                let (rho, weight) = loss.evaluate(s0);
                for s in [0.0, 0.3, 2.0, 9.0, 40.0] {
                    assert!(loss.evaluate(s).0 <= rho + weight * (s - s0) + 1e-12);
                }
            }
        }
    }

    #[test]
    fn flattening_is_second_derivative_of_loss_where_that_is_positive() {
        // Thesis: section 8.4.2: half the loss of a residual r has the curvature rho' + 2 rho'' r^2
        for loss in LOSSES {
            for r in [1e-160, 0.1_f64, 0.7, 1.2, 1.6, 1.9, 2.6, 4.0, 6.0] {
                let half = |r: f64| 0.5 * loss.evaluate(r * r).0;
                let step = 1e-4;
                let truth = (half(r + step) - 2.0 * half(r) + half(r - step)) / (step * step);
                let weight = loss.evaluate(r * r).1;
                let curvature = weight - r * r * loss.flattening(r * r);
                let bounded = truth.max(CURVATURE * weight);
                // second differences of 1 with that step are good to 1e-7
                assert!((curvature - bounded).abs() < 1e-6, "{loss:?} {r}");
            }
        }
    }

    #[test]
    fn threshold_that_is_not_positive_is_an_error() {
        assert!(Loss::Huber(0.0).check().is_err());
        assert!(Loss::Tukey(f64::NAN).check().is_err());
    }
}
