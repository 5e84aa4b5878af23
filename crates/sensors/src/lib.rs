//! Devices: decoders of USB depth cameras and serial IMUs, their transports, clocks and synchronisation.
//!
//! Decoders are pure: bytes in, samples and counted faults out. They resynchronise after garbage,
//! never panic on bytes and hold at most one message or one frame in memory. Transports move
//! bytes and know no formats. The two meet in a device.

pub mod bits;
pub mod clock;
pub mod coded;
pub mod colour;
pub mod disparity;
mod error;
pub mod faults;
pub mod fuzz;
pub mod imu;
pub mod kinect;
pub mod ps1080;
pub mod registration;
pub mod serial;
pub mod sim;
pub mod synchronise;
pub mod usb;
pub mod usb_packet;

pub use error::{Error, Result};
pub use faults::{MessageFaults, PacketFaults};
