//! Diffusion with a data term on the sphere: its symmetric matrix, and a multigrid solver.

mod multigrid;
mod stencil;

pub(crate) use multigrid::Multigrid;
pub(crate) use stencil::{Cells, Stencil};
