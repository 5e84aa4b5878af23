//! Files: data sets, trajectories, calibration, images and point clouds. No devices.

mod beside;
pub mod calibration;
mod error;
pub mod images;
mod packed;
pub mod ply;
pub mod problems;
pub mod recording;
mod rows;
mod times;
pub mod trajectory;
mod warnings;
mod writer;

pub use calibration::{CalibrationFile, CameraEntry, ImuNoise};
pub use error::{Error, Result};
pub use recording::{OpenOptions, Recording, RecordingKind, open_recording};
pub use warnings::{Warning, Warnings};
pub use writer::{ColourFormat, RecordingWriter};
