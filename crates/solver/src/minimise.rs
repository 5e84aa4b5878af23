//! Levenberg-Marquardt: gain-ratio control of the damping, and the stop rules.
//!
//! Thesis: section 8.4.2. The damping follows Nielsen's rule, as in Ceres: after a step with gain
//! ratio `rho` lambda is multiplied by `max(1/3, 1 - (2 rho - 1)^3)` (by 0.1 where `rho` is within 0.1
//! of 1); after a refused one by 2, 4, 8...

use crate::options::{Damping, Options};
use crate::summary::{Iteration, StopReason, Summary};
use crate::{Error, Result};
use std::time::Instant;

/// Beyond this damping no step is long enough to change a number.
const MAX_LAMBDA: f64 = 1e32;
/// Steps refused one after the other before the state is called the best.
const MAX_REFUSED: usize = 30;
/// A model whose promise is kept so well can be believed further than Nielsen's rule does.
const FAITHFUL: f64 = 0.1;
const MIN_LAMBDA: f64 = 1e-20;

/// A damped step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Decrease of the cost by the quadratic model: `-(g.d + d.H d / 2)`.
    pub promised: f64,
    /// Norm of the step.
    pub norm: f64,
    /// Norm of the state.
    pub state_norm: f64,
}

/// A least-squares problem on a manifold. It owns the current state and one candidate.
pub trait System {
    /// Cost of the current state; `None` where a residual does not exist.
    fn cost(&mut self) -> Option<f64>;

    /// Evaluate residuals and Jacobians at the current state; returns the largest absolute entry of
    /// the gradient. The damping is that of the step that follows, if there is one.
    fn linearise(&mut self, damping: Damping, lambda: f64) -> f64;

    /// Solve the damped normal equations and make the candidate. `None` where they are not positive.
    fn step(&mut self, damping: Damping, lambda: f64) -> Option<Step>;

    /// Cost of the candidate; `None` where a residual does not exist there.
    fn candidate_cost(&mut self) -> Option<f64>;

    /// The candidate becomes the current state.
    fn accept(&mut self);
}

/// The multiplier of an entry of the diagonal by damping: what is added to it.
#[inline]
pub fn damping_term(damping: Damping, lambda: f64, diagonal: f64) -> f64 {
    match damping {
        Damping::Identity => lambda,
        Damping::Marquardt => lambda * diagonal.clamp(1e-6, 1e32),
    }
}

/// What the damping is multiplied by after a step that was taken.
fn shrinkage(gain: f64) -> f64 {
    if (gain - 1.0).abs() <= FAITHFUL {
        return 0.1;
    }
    (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0)
}

/// Minimise from the current state on. The state never gets worse, and stays finite.
///
/// # Errors
/// Where a setting is outside its domain, or the cost of the start is not a finite number.
pub fn minimise(system: &mut impl System, options: &Options) -> Result<Summary> {
    options.check()?;
    let begin = Instant::now();
    let cost = match system.cost() {
        Some(cost) if cost.is_finite() => cost,
        found => {
            let found = format!("{found:?}");
            return Err(Error::value("cost of the start", "a finite number", found));
        }
    };
    let mut run = Run {
        options,
        begin,
        lambda: options.initial_lambda,
        growth: 2.0,
        refused: 0,
        summary: Summary {
            initial_cost: cost,
            final_cost: cost,
            iterations: Vec::with_capacity(options.max_iterations.min(10_000)),
            stop: StopReason::MaxIterations,
            elapsed: begin.elapsed(),
        },
    };
    run.summary.stop = run.iterate(system);
    run.summary.elapsed = begin.elapsed();
    Ok(run.summary)
}

struct Run<'a> {
    options: &'a Options,
    begin: Instant,
    lambda: f64,
    growth: f64,
    refused: usize,
    summary: Summary,
}

impl Run<'_> {
    fn iterate(&mut self, system: &mut impl System) -> StopReason {
        let mut linear: Option<f64> = None;
        loop {
            if let Some(reason) = self.bounds() {
                return reason;
            }
            let here = match linear {
                Some(known) => known,
                None => {
                    let new = system.linearise(self.options.damping, self.lambda);
                    if new <= self.options.gradient_tolerance {
                        return StopReason::GradientTolerance;
                    }
                    linear = Some(new);
                    new
                }
            };
            let (accepted, stop) = self.attempt(system, here);
            if accepted {
                linear = None;
            }
            if let Some(reason) = stop {
                return reason;
            }
        }
    }

    /// What ends the iterations from outside.
    fn bounds(&self) -> Option<StopReason> {
        if self.options.stop.is_raised() {
            return Some(StopReason::Interrupted);
        }
        let spent = |budget| self.begin.elapsed() >= budget;
        if self.options.time_budget.is_some_and(spent) {
            return Some(StopReason::TimeBudget);
        }
        (self.summary.iterations.len() >= self.options.max_iterations)
            .then_some(StopReason::MaxIterations)
    }

    /// One step: whether it was taken, and whether it was the last.
    fn attempt(&mut self, system: &mut impl System, here: f64) -> (bool, Option<StopReason>) {
        let lambda = self.lambda;
        let step = system.step(self.options.damping, lambda);
        let cost = self.summary.final_cost;
        let Some(step) = step.filter(|s| s.norm.is_finite() && s.promised.is_finite()) else {
            return (false, self.refuse(here, f64::NAN, f64::NEG_INFINITY, 0.0));
        };
        let tolerance = self.options.parameter_tolerance;
        let short = step.norm <= tolerance * (step.state_norm + tolerance);
        let next = system.candidate_cost().filter(|c| c.is_finite());
        let decrease = next.map_or(f64::NEG_INFINITY, |next| cost - next);
        let gain = decrease / step.promised;
        let flat = decrease.abs() <= self.options.function_tolerance * cost;
        // where the cost changes by its own rounding the gain ratio is noise
        let taken = decrease >= 0.0 && (gain >= self.options.min_gain || flat);
        if taken {
            system.accept();
            self.summary.final_cost = cost - decrease;
            self.lambda = (lambda * shrinkage(gain)).clamp(MIN_LAMBDA, MAX_LAMBDA);
            self.growth = 2.0;
            self.refused = 0;
            self.record(here, step.norm, decrease, gain, lambda, true);
        }
        if short {
            return (taken, Some(StopReason::ParameterTolerance));
        }
        if flat {
            return (taken, Some(StopReason::FunctionTolerance));
        }
        if taken {
            return (true, None);
        }
        (false, self.refuse(here, step.norm, decrease, gain))
    }

    fn refuse(&mut self, here: f64, norm: f64, decrease: f64, gain: f64) -> Option<StopReason> {
        self.record(here, norm, decrease, gain, self.lambda, false);
        self.lambda = self.lambda.max(MIN_LAMBDA) * self.growth;
        self.growth *= 2.0;
        self.refused += 1;
        (self.lambda > MAX_LAMBDA || self.refused > MAX_REFUSED).then_some(StopReason::NoDescent)
    }

    fn record(
        &mut self,
        here: f64,
        step: f64,
        decrease: f64,
        gain: f64,
        lambda: f64,
        accepted: bool,
    ) {
        self.summary.iterations.push(Iteration {
            cost: self.summary.final_cost,
            decrease,
            gain,
            gradient: here,
            step,
            lambda,
            accepted,
            elapsed: self.begin.elapsed(),
        });
    }
}
