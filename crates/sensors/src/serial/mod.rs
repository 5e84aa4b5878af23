//! Serial IMUs on real ports: opening, configuring, samples with the host's time.

mod imu;
mod link;

pub use imu::{ImuKind, SerialImu, SerialSample};
pub use link::SerialLink;
