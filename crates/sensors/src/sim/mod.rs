//! Simulated devices that speak the real protocols, with scripted faults.

mod epson;
mod kinect;
mod kinect_registers;
mod ps1080;
#[cfg(unix)]
mod pty;

pub use epson::{EpsonSimulator, Script};
pub use kinect::{KinectScript, KinectSimulator, Picture};
pub use ps1080::Ps1080Simulator;
#[cfg(unix)]
pub use pty::PtyEpson;
