//! Biases of measured velocities from brightness and range images (Chapter 5).
//!
//! `omega_m = omega + omega_b`, `v_m = v + v_b` (body frame of the camera), Thesis: eq. (5.1), and the
//! images move by the true velocities. Three estimators: the thesis's observer with its own gains,
//! the same with gains normalised by the Gram matrix of the images, and the information form.

mod alignment;
mod config;
mod debiased;
mod estimator;
mod images;
mod information;
mod observer;
mod references;
mod row_motion;
#[cfg(test)]
mod tests;
mod tracking;
mod window;

pub use config::{BiasMethod, FixedGains, VelocityBiasConfig};
pub use estimator::{VelocityBiasEstimator, VelocityBiasState};
pub use information::{BiasInformation, BiasPrior, PoseInformation};
pub use observer::{FieldObserver, Gains, ImageVelocity};
pub use window::Window;
