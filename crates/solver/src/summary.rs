//! What the iterations did and why they ended.

use std::fmt;
use std::time::Duration;

/// Why the iterations ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// The last step changed the cost by less than `function_tolerance` of it.
    FunctionTolerance,
    /// No entry of the gradient is larger than `gradient_tolerance`.
    GradientTolerance,
    /// The last step was shorter than `parameter_tolerance` of the state.
    ParameterTolerance,
    /// `max_iterations` steps were tried.
    MaxIterations,
    /// The time budget is spent.
    TimeBudget,
    /// The stop flag was raised.
    Interrupted,
    /// No step lowers the cost, however short; the state is the best found.
    NoDescent,
    /// There is nothing to estimate: everything is fixed, or nothing was measured.
    NothingToDo,
}

impl StopReason {
    /// True where one of the tolerances was met.
    pub fn converged(&self) -> bool {
        matches!(
            self,
            Self::FunctionTolerance | Self::GradientTolerance | Self::ParameterTolerance
        )
    }

    /// `function_tolerance`, `gradient_tolerance`, ... as in the options.
    pub fn name(&self) -> &'static str {
        match self {
            Self::FunctionTolerance => "function_tolerance",
            Self::GradientTolerance => "gradient_tolerance",
            Self::ParameterTolerance => "parameter_tolerance",
            Self::MaxIterations => "max_iterations",
            Self::TimeBudget => "time_budget",
            Self::Interrupted => "interrupted",
            Self::NoDescent => "no_descent",
            Self::NothingToDo => "nothing_to_do",
        }
    }
}

impl fmt::Display for StopReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.name())
    }
}

/// One step that was tried.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// Cost after it.
    pub cost: f64,
    /// By how much it lowered the cost; negative or infinite where it was refused.
    pub decrease: f64,
    /// Decrease over the decrease that the quadratic model promised.
    pub gain: f64,
    /// Largest entry of the gradient before it.
    pub gradient: f64,
    /// Norm of the step.
    pub step: f64,
    /// Damping factor it was made with.
    pub lambda: f64,
    /// Whether it was taken.
    pub accepted: bool,
    /// Time since the beginning.
    pub elapsed: Duration,
}

/// What the iterations did.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Cost of the start: half the sum of the losses.
    pub initial_cost: f64,
    /// Cost of the result.
    pub final_cost: f64,
    /// Every step that was tried.
    pub iterations: Vec<Iteration>,
    /// Why they ended.
    pub stop: StopReason,
    /// Time taken.
    pub elapsed: Duration,
}
