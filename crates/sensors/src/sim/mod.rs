//! Simulated devices that speak the real protocols, with scripted faults.

mod epson;
#[cfg(unix)]
mod pty;

pub use epson::{EpsonSimulator, Script};
#[cfg(unix)]
pub use pty::PtyEpson;
