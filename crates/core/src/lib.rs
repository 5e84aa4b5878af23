//! The vocabulary of sphereflow: what a stamp, an image, a depth, a pose and a status are.
//!
//! Nothing here computes; every other crate speaks in these words. Units are SI, time is integer
//! nanoseconds, unknown depth is NaN, and transforms are named `target_from_source` so that
//! adjacent names cancel.

pub mod checks;
mod error;
mod frame;
mod plane;
mod pose;
mod reason_code;
mod sample;
mod sensors;
mod stamp;
pub mod statistics;
mod status;
mod trajectory;

pub use error::Error;
pub use frame::{RgbdFrame, grey};
pub use plane::{DepthMap, Plane, RangeMap};
pub use pose::Pose;
pub use reason_code::{ReasonCode, ReasonField, ReasonValue};
pub use sample::{ImuBatch, Sample};
pub use sensors::{ImuSample, MagSample, Twist};
pub use stamp::Stamp;
pub use status::{Reason, TrackStatus};
pub use trajectory::{Trajectory, associate};

/// Result of the crate's fallible calls.
pub type Result<T> = std::result::Result<T, Error>;
