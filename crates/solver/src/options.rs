//! When and how the iterations stop, and how steps are damped.

use crate::Result;
use sphereflow_core::checks::{each, non_negative};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Thesis: section 8.4.2: what the normal matrix is augmented by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Damping {
    /// `lambda diag(J^T J)`: steps do not depend on the units of the unknowns.
    #[default]
    Marquardt,
    /// `lambda I`.
    Identity,
}

/// A flag by which another thread ends the iterations; copies are the same flag.
#[derive(Clone, Debug, Default)]
pub struct StopFlag(Arc<AtomicBool>);

impl StopFlag {
    /// A flag that is not raised.
    pub fn new() -> Self {
        Self::default()
    }

    /// Ask for the end, which comes after the iteration under way.
    pub fn raise(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Take the wish back.
    pub fn clear(&self) {
        self.0.store(false, Ordering::Relaxed);
    }

    /// True once raised.
    pub fn is_raised(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Settings of the Levenberg-Marquardt iterations.
#[derive(Clone, Debug)]
pub struct Options {
    /// Steps tried at most, accepted or not.
    pub max_iterations: usize,
    /// Stop where a step changes the cost by less than this share of it.
    pub function_tolerance: f64,
    /// Stop where no entry of the gradient is larger than this.
    pub gradient_tolerance: f64,
    /// Stop where a step is shorter than this share of the state's norm.
    pub parameter_tolerance: f64,
    /// What is added to the normal matrix.
    pub damping: Damping,
    /// The damping factor of the first step.
    pub initial_lambda: f64,
    /// Steps that lower the cost by less than this share of what the model promised are refused.
    pub min_gain: f64,
    /// Time after which no further iteration is begun.
    pub time_budget: Option<Duration>,
    /// Checked between iterations.
    pub stop: StopFlag,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            max_iterations: 50,
            function_tolerance: 1e-6,
            gradient_tolerance: 1e-10,
            parameter_tolerance: 1e-8,
            damping: Damping::default(),
            initial_lambda: 1e-4,
            min_gain: 1e-3,
            time_budget: None,
            stop: StopFlag::new(),
        }
    }
}

impl Options {
    /// # Errors
    /// Naming the setting outside its domain.
    pub fn check(&self) -> Result<()> {
        let settings = [
            ("function_tolerance", self.function_tolerance),
            ("gradient_tolerance", self.gradient_tolerance),
            ("parameter_tolerance", self.parameter_tolerance),
            ("initial_lambda", self.initial_lambda),
            ("min_gain", self.min_gain),
        ];
        Ok(each(non_negative, &settings)?)
    }
}
