//! Operators on planes: Gaussian smoothing, gradients, sampled reads, padded planes, noise level.
//!
//! A plane is an image of single-precision numbers, `(width, height)` pixels with centres at integers;
//! what is unknown is NaN. Nothing here knows of cameras: what goes around from the last column to the
//! first says so by itself (`wraps`).

pub mod bilinear;
mod blank;
mod derivatives;
mod gaussian;
mod noise;
mod padded;
mod size;

pub use blank::is_blank;
pub use derivatives::{Derivatives, PairRows, sobel, sobel_into};
pub use gaussian::Gaussian;
pub use noise::{BLACK, SATURATED, measured_noise, median_noise};
pub use padded::{LANES, Padded};
pub use size::same_size;

pub use sphereflow_core::{Error, Result};
