//! Loop edges that may be wrong as a whole: switched off during the minimisation.

use super::problem::EdgeKind;
use crate::minimise::{System, minimise};
use crate::options::Options;
use crate::summary::{StopReason, Summary};
use crate::{Loss, Result};
use sphereflow_core::checks::positive;

/// How wrong loop edges are told from right ones. Thresholds are of the squared whitened residual:
/// 16.8 is the 99 % quantile of 6 degrees of freedom.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum LoopSwitch {
    /// Every edge counts by its own loss.
    #[default]
    Off,
    /// Dynamic covariance scaling (Agarwal et al., 2013): from `phi` on the cost of an edge grows
    /// ever more slowly.
    Scaled {
        /// Squared residual from which an edge is doubted.
        phi: f64,
    },
    /// Graduated non-convexity (Yang et al., 2020) of the truncated square: edges end as right or wrong,
    /// whatever the start.
    Graduated {
        /// Squared residual from which an edge is wrong.
        threshold: f64,
    },
}

/// What the robust switch did.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct RobustSummary {
    /// Edges that count less than half, ascending.
    pub rejected: Vec<usize>,
    /// Passes of the graduation; 1 without one.
    pub passes: usize,
}

/// The non-convexity grows by this from pass to pass.
const GROWTH: f64 = 1.4;
/// Growth by 1.4 to this power is 1e14: far beyond the largest residual over the threshold.
const MAX_PASSES: usize = 100;
/// Steps of a pass: the next one continues where this one ends.
const STEPS: usize = 10;

impl LoopSwitch {
    /// # Errors
    /// Where the threshold is not a positive number.
    pub fn check(&self) -> Result<()> {
        match *self {
            Self::Scaled { phi: k } | Self::Graduated { threshold: k } => {
                Ok(positive("loop switch", k)?)
            }
            Self::Off => Ok(()),
        }
    }

    /// Loss and weight of a squared residual of an edge with a loss of its own; the graduation has
    /// weights of its own.
    #[inline]
    pub(super) fn evaluate(&self, (kind, loss): (EdgeKind, Loss), s: f64) -> (f64, f64) {
        match *self {
            Self::Scaled { phi } if kind == EdgeKind::Loop && s > phi => (
                phi * (3.0 * s - phi) / (s + phi),
                4.0 * phi * phi / ((s + phi) * (s + phi)),
            ),
            _ => loss.evaluate(s),
        }
    }
}

/// The weight of a squared residual `s` at the non-convexity `mu`: between 1 and 0.
fn weight(s: f64, threshold: f64, mu: f64) -> f64 {
    if s <= mu / (mu + 1.0) * threshold {
        1.0
    } else if s >= (mu + 1.0) / mu * threshold {
        0.0
    } else {
        (threshold / s * mu * (mu + 1.0)).sqrt() - mu
    }
}

/// A system of edges whose weights a robust switch sets.
pub(super) trait Weighted: System {
    /// Bring the squared residuals up to the present state.
    fn measure(&mut self);

    /// Kind, squared whitened residual when last measured, and how much it counts, of every edge.
    fn edges(&self) -> impl Iterator<Item = (EdgeKind, f64, f64)>;

    /// Weights of the loop edges from their squared residuals when last measured.
    fn reweight(&mut self, weight: impl Fn(f64) -> f64);
}

/// The edges that count less than half at the present state.
pub(super) fn judge(system: &mut impl Weighted) -> RobustSummary {
    system.measure();
    let felt = system.edges().map(|(_, _, felt)| felt).enumerate();
    RobustSummary {
        rejected: felt
            .filter(|(_, felt)| *felt < 0.5)
            .map(|(k, _)| k)
            .collect(),
        passes: 1,
    }
}

/// Weights of the loop edges at `mu`; true where all are 0 or 1.
fn reweight(system: &mut impl Weighted, threshold: f64, mu: f64) -> bool {
    system.measure();
    let weight = |square: f64| weight(square, threshold, mu);
    let decided = loops(system).map(weight).all(|w| w == 0.0 || w == 1.0);
    system.reweight(weight);
    decided
}

/// The squared residuals of the loop edges.
fn loops(system: &impl Weighted) -> impl Iterator<Item = f64> {
    let all = system.edges();
    all.filter_map(|(kind, square, _)| (kind == EdgeKind::Loop).then_some(square))
}

/// Minimise with all edges, then again and again with the doubted ones counting less, until every loop
/// edge is right or wrong; the last pass is a full minimisation. The time budget is of all of them.
pub(super) fn graduate(
    system: &mut impl Weighted,
    threshold: f64,
    options: &Options,
) -> Result<(Summary, RobustSummary)> {
    let short = Options {
        max_iterations: STEPS.min(options.max_iterations),
        function_tolerance: options.function_tolerance.max(1e-6),
        ..options.clone()
    };
    let begin = std::time::Instant::now();
    let left = |options: &Options| Options {
        time_budget: options
            .time_budget
            .map(|b| b.saturating_sub(begin.elapsed())),
        ..options.clone()
    };
    let first = minimise(system, &left(&short))?;
    system.measure();
    let worst = loops(system).fold(0.0, f64::max);
    let mut mu = threshold / (2.0 * worst - threshold).max(f64::MIN_POSITIVE);
    let mut passes = 1;
    let ended = |stop: StopReason| matches!(stop, StopReason::Interrupted | StopReason::TimeBudget);
    let mut stop = first.stop;
    while worst > threshold && passes < MAX_PASSES && !ended(stop) {
        let decided = reweight(system, threshold, mu);
        if decided && passes > 1 {
            break;
        }
        stop = minimise(system, &left(&short))?.stop;
        mu *= GROWTH;
        passes += 1;
    }
    let mut summary = minimise(system, &left(options))?;
    summary.elapsed = begin.elapsed();
    let robust = RobustSummary {
        passes: passes + 1,
        ..judge(system)
    };
    Ok((summary, robust))
}
