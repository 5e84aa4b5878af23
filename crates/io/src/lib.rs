//! Files: data sets, trajectories, calibration, images and point clouds. No devices.

mod beside;
pub mod calibration;
mod error;
pub mod images;
pub mod recording;
mod rows;
pub mod trajectory;
mod warnings;

pub use calibration::{Calibration, ImuNoise};
pub use error::{Error, Result};
pub use warnings::{Warning, Warnings};
