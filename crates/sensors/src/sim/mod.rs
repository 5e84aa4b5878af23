//! Simulated devices that speak the real protocols, with scripted faults.

mod epson;
mod kinect;
mod kinect_registers;
#[cfg(unix)]
mod pty;

pub use epson::{EpsonSimulator, Script};
pub use kinect::{KinectScript, KinectSimulator, Picture};
#[cfg(unix)]
pub use pty::PtyEpson;
