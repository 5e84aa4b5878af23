//! Tests of the grid against closed forms and under refinement.

mod balance;
mod convergence;
mod fields;
mod geometry;
mod pinhole;
