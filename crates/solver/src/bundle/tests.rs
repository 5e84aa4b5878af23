//! Bundle adjustment of generated scenes.

mod bad_input;
mod derivatives;
mod device;
mod duals;
mod inertial;
mod marginal;
mod problems;
mod relative;
mod rolling;
mod uncertainty;
