//! Device clocks: ticks that wrap, and what the host's clock shows at each of them.

mod fit;
mod ticks;

pub use fit::{ClockFit, ClockState};
pub use ticks::{TickFaults, Ticks};
