//! `SolverResult`: what an adjustment did.

use crate::plain::{Plain, plain_struct};
use crate::reduce::{Reduced, reduced};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sphereflow_solver::{LinearSolver, Summary};
use std::time::Duration;

/// What an adjustment did and why it ended.
#[pyclass(name = "SolverResult", module = "sphereflow.solver", frozen)]
pub struct PySolverResult {
    pub summary: Summary,
    pub issues: Vec<String>,
    pub linear_solver: Option<LinearSolver>,
    pub rejected: Vec<usize>,
    pub setup: Duration,
}

plain_struct!(PySolverResult {
    summary,
    issues,
    linear_solver,
    rejected,
    setup
});

#[pymethods]
impl PySolverResult {
    /// Cost of the start: half the sum of the losses of squared whitened residuals.
    #[getter]
    fn initial_cost(&self) -> f64 {
        self.summary.initial_cost
    }

    /// Cost of the result.
    #[getter]
    fn final_cost(&self) -> f64 {
        self.summary.final_cost
    }

    /// Why it ended: "function_tolerance", "gradient_tolerance", "parameter_tolerance",
    /// "max_iterations", "time_budget", "interrupted", "no_descent" or "nothing_to_do".
    #[getter]
    fn stop(&self) -> &'static str {
        self.summary.stop.name()
    }

    /// True where one of the tolerances was met.
    #[getter]
    fn converged(&self) -> bool {
        self.summary.stop.converged()
    }

    /// Every step that was tried: dicts with cost, decrease, gain, gradient, step, lambda, accepted,
    /// elapsed_s.
    #[getter]
    fn iterations<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let entry = |step: &sphereflow_solver::Iteration| {
            let dict = PyDict::new(py);
            dict.set_item("cost", step.cost)?;
            dict.set_item("decrease", step.decrease)?;
            dict.set_item("gain", step.gain)?;
            dict.set_item("gradient", step.gradient)?;
            dict.set_item("step", step.step)?;
            dict.set_item("lambda", step.lambda)?;
            dict.set_item("accepted", step.accepted)?;
            dict.set_item("elapsed_s", step.elapsed.as_secs_f64())?;
            Ok(dict)
        };
        self.summary.iterations.iter().map(entry).collect()
    }

    /// What the measurements do not determine, and measurements that were left out, in words.
    #[getter]
    fn issues(&self) -> Vec<String> {
        self.issues.clone()
    }

    /// How the reduced system was solved: "dense", "sparse" or "iterative"; None for a graph.
    #[getter]
    fn linear_solver(&self) -> Option<&'static str> {
        self.linear_solver.map(|kind| match kind {
            LinearSolver::Auto => "auto",
            LinearSolver::Dense => "dense",
            LinearSolver::Sparse => "sparse",
            LinearSolver::Iterative => "iterative",
        })
    }

    /// Loop edges that count less than half: indices.
    #[getter]
    fn rejected(&self) -> Vec<usize> {
        self.rejected.clone()
    }

    /// Seconds for the iterations.
    #[getter]
    fn solve_s(&self) -> f64 {
        self.summary.elapsed.as_secs_f64()
    }

    /// Seconds for laying the problem out.
    #[getter]
    fn setup_s(&self) -> f64 {
        self.setup.as_secs_f64()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        reduced(py, "SolverResult", self.to_plain(py)?)
    }

    fn __repr__(&self) -> String {
        format!(
            "SolverResult({:.9e} -> {:.9e}, {} steps, {}, {} issues)",
            self.summary.initial_cost,
            self.summary.final_cost,
            self.summary.iterations.len(),
            self.summary.stop,
            self.issues.len()
        )
    }
}
