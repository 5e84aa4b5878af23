//! Device clocks: ticks that wrap, and what the host's clock shows at each of them.

mod fit;
mod stream;
mod ticks;

pub use fit::{ClockFit, ClockState};
pub use stream::StreamClock;
pub use ticks::{TickFaults, Ticks};
