//! Nonlinear least squares on manifolds: bundle adjustment and pose graphs (Chapters 8 and 9).
//!
//! [`minimise`] is Levenberg-Marquardt for any [`System`].

#[cfg(test)]
extern crate self as sphereflow_solver; // by which the simulator's problems name this crate

pub mod bundle;
#[cfg(test)]
mod dual;
mod error;
#[cfg(test)]
#[path = "../../sim/src/problems/mod.rs"]
mod generate; // the simulator's problems, of this very crate's types
pub mod graph;
pub mod inertial;
mod linear;
mod loss;
mod minimise;
mod options;
mod summary;

pub use error::{Error, Result};
pub use linear::LinearSolver;
pub use loss::Loss;
pub use minimise::{Step, System, damping_term, minimise};
pub use options::{Damping, Options, StopFlag};
pub use summary::{Iteration, StopReason, Summary};
