//! Nonlinear least squares on manifolds: bundle adjustment and pose graphs (Chapters 8 and 9).
//!
//! [`minimise`] is Levenberg-Marquardt for any [`System`].

pub mod bundle;
#[cfg(test)]
mod dual;
mod error;
pub mod generate;
pub mod graph;
pub mod inertial;
mod linear;
mod loss;
mod minimise;
mod options;
mod summary;

pub use error::{Error, Result};
pub use linear::LinearSolver;
pub use loss::{Loss, mad_scale};
pub use minimise::{Step, System, damping_term, minimise};
pub use options::{Damping, Options, StopFlag};
pub use summary::{Iteration, StopReason, Summary};
