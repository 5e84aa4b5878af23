//! Inertial terms: pre-integrated IMU samples between poses, and a window of states tied by them.

#[cfg(test)]
mod duals;
pub(crate) mod link;
mod preintegration;
#[cfg(test)]
pub(crate) mod tests;
mod window;

pub use link::InertialState;
pub(crate) use preintegration::finite;
pub use preintegration::{ImuBias, ImuSigmas, Preintegration};
pub use window::InertialWindow;
