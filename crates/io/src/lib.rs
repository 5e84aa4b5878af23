//! Files: data sets, trajectories, calibration, images and point clouds. No devices.

mod beside;
mod error;
mod rows;
pub mod trajectory;
mod warnings;

pub use error::{Error, Result};
pub use warnings::{Warning, Warnings};
