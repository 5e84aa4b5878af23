//! Bundle adjustment of generated scenes.

mod bad_input;
mod derivatives;
mod duals;
mod inertial;
mod problems;
mod uncertainty;
