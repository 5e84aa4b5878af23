//! Calibration from recordings: each says whether the recording excites what it estimates.
//!
//! [`SelfCalibrator`] finds the lens, the depth field and the read-out time of a depth camera from
//! its own motion; [`imu_still`] the biases and noise of an IMU at rest; [`mag_ellipsoid`] the hard
//! and soft iron of a magnetometer; [`camera_imu`] the rotation and time offset between camera and
//! IMU.

mod camera_imu;
mod imu_still;
mod mag_ellipsoid;
mod self_calibration;
#[cfg(test)]
mod sensor_tests;
mod series;

pub use camera_imu::{CameraImu, camera_imu};
pub use imu_still::{ImuStill, imu_still};
pub use mag_ellipsoid::{MagEllipsoid, mag_ellipsoid};
pub use self_calibration::{
    CalibratedParameter, CalibrationStatus, HeldCombination, SelfCalibration,
    SelfCalibrationConfig, SelfCalibrator,
};

/// Result of the crate's fallible calls: a core error names the argument, what was expected and
/// what was found. A recording that does not excite what is sought is no error but a status.
pub use sphereflow_core::Result;
