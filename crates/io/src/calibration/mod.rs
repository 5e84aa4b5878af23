//! Calibration files: one TOML with every parameter by its name, nothing unknown tolerated.
//!
//! ```toml
//! schema = 2                  # of this layout; files without it are of schema 1, and still read
//! depth_scale = 5000.0        # counts per metre
//! readout_s = 0.02            # optional: rolling shutter; row y of H is exposed
//!                             # ((y + 1/2)/H - 1/2) readout_s after the stamp; < 0: bottom first
//! colour_offset_s = 0.012     # optional: middle of the colour exposure = colour stamp + this
//! imu_offset_s = 0.005        # optional: imu_time = camera_time + imu_offset_s
//! gravity_in_world_m_s2 = [0.0, 9.81, 0.0]  # optional: of the truth's world, pointing down
//!
//! [depth]                     # the depth camera
//! model = "pinhole"
//! width = 640
//! height = 480
//! parameters = { fx = 525.0, fy = 525.0, cx = 319.5, cy = 239.5 }
//!
//! [colour]                    # optional: the colour camera, where it is another
//! model = "pinhole"
//! # ...
//!
//! [colour_from_depth]         # optional
//! translation = [0.0, 0.0, 0.0]
//! quat_xyzw = [0.0, 0.0, 0.0, 1.0]
//!
//! [depth_field.relative]      # optional: 1/Z_true = (1 + m) / Z_measured + a, what is not named
//! z1 = -0.02                  # is 0; terms of m: one, z1, z2, z1_z1, z1_z2, z2_z2, r2_z1, r2_z2,
//! r4 = -0.05                  # r4 with z1 = x/z, z2 = y/z, r2 = z1^2 + z2^2
//!
//! [depth_field.additive]      # terms of a, 1/m
//! one = 0.001
//!
//! [camera_from_imu]           # optional
//! translation = [0.0, 0.0, 0.0]
//! quat_xyzw = [0.0, 0.0, 0.0, 1.0]
//!
//! [imu_noise]                 # optional; Kalibr's names and units
//! gyroscope_noise_density = 1.7e-4      # rad/s/sqrt(Hz)
//! gyroscope_random_walk = 2.0e-5        # rad/s^2/sqrt(Hz)
//! accelerometer_noise_density = 2.0e-3  # m/s^2/sqrt(Hz)
//! accelerometer_random_walk = 3.0e-3    # m/s^3/sqrt(Hz)
//!
//! [deviations]                # optional: standard deviations by the entry's name
//! readout_s = 0.0004
//! ```
//!
//! Schema 1 had the depth camera's entries at the top, and `depth_correction` and `time_offset_s` for
//! `depth_field` and `imu_offset_s`.

mod camera;
mod document;
mod layout;
mod migration;
mod published;

pub(crate) use published::{published, ros_default};

use nalgebra::Vector3;
use sphereflow_core::Pose;
use sphereflow_sphere::DepthCorrection;
use std::collections::BTreeMap;

/// Noise of an IMU, in Kalibr's names and units.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImuNoise {
    /// White noise of the gyro, rad/s/sqrt(Hz).
    pub gyroscope_noise_density: f64,
    /// Random walk of the gyro's bias, rad/s^2/sqrt(Hz).
    pub gyroscope_random_walk: f64,
    /// White noise of the accelerometer, m/s^2/sqrt(Hz).
    pub accelerometer_noise_density: f64,
    /// Random walk of the accelerometer's bias, m/s^3/sqrt(Hz).
    pub accelerometer_random_walk: f64,
}

/// A camera as a file names it.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraEntry {
    /// Name of the camera model: `pinhole`, `opencv`, `equirectangular`, ...
    pub model: String,
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The model's parameters by name.
    pub parameters: BTreeMap<String, f64>,
}

/// What a calibration file says of a device, its depth images and its IMU; see
/// [`CalibrationFile::calibration`] for the form in which estimators take it.
#[derive(Clone, Debug, PartialEq)]
pub struct CalibrationFile {
    /// The depth camera.
    pub depth: CameraEntry,
    /// The colour camera; `None` where it is not known apart from the depth camera.
    pub colour: Option<CameraEntry>,
    /// Where the depth camera sits in the colour camera's frame.
    pub colour_from_depth: Option<Pose>,
    /// Counts of the depth images per metre.
    pub depth_scale: f64,
    /// Rolling shutter: seconds between the exposures of the first and the last row; row `y` of `H`
    /// is exposed `((y + 1/2)/H - 1/2) readout_s` after the stamp. Negative where the last is first.
    pub readout_s: Option<f64>,
    /// Middle of the colour exposure = colour stamp + this.
    pub colour_offset_s: Option<f64>,
    /// `imu_time = camera_time + imu_offset_s`; readers leave IMU stamps as they are.
    pub imu_offset_s: Option<f64>,
    /// What makes true depth of the measured one; recordings are corrected when they are read.
    pub depth_field: Option<DepthCorrection>,
    /// Gravity in the world of the recording's truth, m/s^2, pointing down.
    pub gravity_in_world_m_s2: Option<Vector3<f64>>,
    /// Where the IMU sits: `camera_from_imu`.
    pub camera_from_imu: Option<Pose>,
    /// Noise of the IMU.
    pub imu_noise: Option<ImuNoise>,
    /// Standard deviations by the name of the entry (`readout_s`, `depth_field.relative.z1`, ...).
    pub deviations: BTreeMap<String, f64>,
}
