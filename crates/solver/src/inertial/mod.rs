//! Inertial terms: pre-integrated IMU samples between poses, and a window of states tied by them.

#[cfg(test)]
mod duals;
mod preintegration;
#[cfg(test)]
mod tests;
mod window;

pub use preintegration::{ImuBias, ImuSigmas, Preintegration};
pub use window::{InertialState, InertialWindow};
