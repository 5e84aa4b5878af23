//! Bundle adjustment of generated scenes.

mod bad_input;
mod derivatives;
mod problems;
mod uncertainty;
