//! Epson M-G3xx inertial units on a UART: burst messages, registers, automatic configuration.

mod burst;
mod model;
mod registers;
mod setup;

pub use burst::{Burst, BurstFormat, Counter, burst_decoder};
pub use model::{MODELS, Model, find_model};
pub use registers::{Register, read, select_window, write};
pub use setup::{Action, Setup, output_rates};
