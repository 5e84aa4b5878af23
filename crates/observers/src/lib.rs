//! Observers of motion: small state machines `step(dt, input) -> state`.
//!
//! Cheap gyros, accelerometers and velocity sensors lie by a constant. The thesis's observers
//! (Chapters 5, 7, sections 9.4 to 9.6) find it; the estimators of today's practice stand beside
//! them under the same interface. A sample that is wrong gives a [`Status`] with a [`Reason`], never
//! a state that is not finite.

pub mod attitude;
mod checks;
mod error;
#[cfg(test)]
mod flaws;
pub mod imu_bias;
mod imu_noise;
mod kalman;
mod limits;
pub mod navigation;
mod spikes;
mod status;
pub mod velocity_bias;

pub use error::Error;
pub use imu_noise::reading_sigma;
pub use status::{Reason, Sensor, Status};

/// Result of the crate's fallible calls.
pub type Result<T> = std::result::Result<T, Error>;
