//! Settings of optical flow and denoising.

use super::Settings;
use crate::errors::IntoPython;
use crate::plain::{Plain, dict_of, field, plain_names, plain_struct};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sphereflow_core::Plane;
pub use sphereflow_flow::{HornSchunckConfig, RofConfig, TvL1Config};
use sphereflow_flow::{HornSchunckSolver, TvL1Flow, horn_schunck, rof_denoise};

// Keys are the words that the functions have: `lambda` is a keyword of Python.
plain_struct!(RofConfig {
    beta2 as "weight",
    tau,
    iterations
});
plain_struct!(TvL1Config {
    lambda as "weight",
    split,
    warps,
    iterations,
    levels,
    median_radius,
    presmooth_px
});

/// The solver without its numbers.
#[derive(Clone, Copy, PartialEq)]
pub enum SolverKind {
    /// Jacobi's iteration.
    Jacobi,
    /// Over-relaxation.
    Sor,
}
plain_names!(SolverKind { "jacobi" => Jacobi, "sor" => Sor });

/// Largest change at which over-relaxation stops, pixels: a hundredth of what noise leaves.
const TOLERANCE_PX: f32 = 1e-4;

/// Kind, sweeps and tolerance of a solver.
pub fn parts(solver: &HornSchunckSolver) -> (SolverKind, usize, f32) {
    match *solver {
        HornSchunckSolver::Jacobi { sweeps } => (SolverKind::Jacobi, sweeps, TOLERANCE_PX),
        HornSchunckSolver::Sor {
            tolerance_px,
            sweeps,
        } => (SolverKind::Sor, sweeps, tolerance_px),
    }
}

/// The solver of its parts.
pub fn solver((kind, sweeps, tolerance_px): (SolverKind, usize, f32)) -> HornSchunckSolver {
    match kind {
        SolverKind::Jacobi => HornSchunckSolver::Jacobi { sweeps },
        SolverKind::Sor => HornSchunckSolver::Sor {
            tolerance_px,
            sweeps,
        },
    }
}

impl Plain for HornSchunckConfig {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let Self {
            alpha,
            aspect,
            solver,
        } = self;
        let (kind, sweeps, tolerance_px) = parts(solver);
        let dict = PyDict::new(py);
        dict.set_item("alpha", alpha.to_plain(py)?)?;
        dict.set_item("aspect", aspect.to_plain(py)?)?;
        dict.set_item("solver", kind.to_plain(py)?)?;
        dict.set_item("sweeps", sweeps)?;
        dict.set_item("tolerance_px", tolerance_px.to_plain(py)?)?;
        Ok(dict.into_any())
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let dict = dict_of(value)?;
        let (kind, sweeps) = (field(dict, "solver")?, field(dict, "sweeps")?);
        Ok(Self {
            alpha: field(dict, "alpha")?,
            aspect: field(dict, "aspect")?,
            solver: solver((kind, sweeps, field(dict, "tolerance_px")?)),
        })
    }
}

/// A blank image: settings are checked before it is found to be one.
fn blank() -> Plane<f32> {
    Plane::filled(2, 2, 0.0)
}

impl Settings for HornSchunckConfig {
    const NAME: &'static str = "HornSchunckConfig";

    fn defaults() -> Self {
        Self::default()
    }

    fn check(&self) -> PyResult<()> {
        let flow = horn_schunck(&blank(), &blank(), self, None);
        flow.map(|_| ()).into_python()
    }
}

impl Settings for TvL1Config {
    const NAME: &'static str = "TvL1Config";

    fn defaults() -> Self {
        Self::default()
    }

    fn check(&self) -> PyResult<()> {
        TvL1Flow::new(*self).map(|_| ()).into_python()
    }
}

impl Settings for RofConfig {
    const NAME: &'static str = "RofConfig";

    fn defaults() -> Self {
        Self::default()
    }

    fn check(&self) -> PyResult<()> {
        let few = Self {
            iterations: self.iterations.min(1),
            ..*self
        };
        rof_denoise(&blank(), &few).map(|_| ()).into_python()
    }
}
