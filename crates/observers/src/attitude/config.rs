//! Settings of the attitude filter.

use crate::Result;
use sphereflow_core::checks;

/// Which estimator answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Today's standard for an IMU alone: strapdown integration, inclination from the low-passed
    /// specific force in an inertial frame, heading from an undisturbed field, gyro bias from
    /// motion and from rest (after Laidig and Seel, "VQF", Information Fusion 91, 2023).
    #[default]
    Inertial,
    /// The invariant observer of the thesis's section 9.4 (after Martin and Salaün, 2010).
    Invariant,
}

/// Axes of the world that attitudes are told in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum World {
    /// x east, y magnetic north, z up: the frame of most inertial software.
    #[default]
    EastNorthUp,
    /// x east, y down, z magnetic north: the axes of a camera, and of the simulator's world.
    RightDownForward,
}

/// Settings of [`super::AttitudeFilter`]. One set serves all recordings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttitudeConfig {
    /// The estimator.
    pub method: Method,
    /// Frame of the answers.
    pub world: World,
    /// Time constant of the inclination's correction, seconds.
    pub tau_accel_s: f64,
    /// Time constant of the heading's correction, seconds.
    pub tau_mag_s: f64,
    /// Estimate the gyro's bias while moving.
    pub motion_bias: bool,
    /// Estimate the gyro's bias at rest.
    pub rest_bias: bool,
    /// Leave out a disturbed magnetic field.
    pub reject_disturbance: bool,
    /// Largest bias of an axis, rad/s.
    pub bias_clip_rad_s: f64,
    /// Standard deviation of the bias at the start, rad/s.
    pub bias_sigma_start_rad_s: f64,
    /// Standard deviation that the bias reaches in motion, rad/s.
    pub bias_sigma_motion_rad_s: f64,
    /// Standard deviation that the bias reaches at rest, rad/s.
    pub bias_sigma_rest_rad_s: f64,
    /// Time in which the bias forgets 0.1 deg/s, seconds.
    pub bias_forgetting_s: f64,
    /// Gain of the invariant observer's attitude, 1/s.
    pub invariant_gain: f64,
    /// Gain of the invariant observer's bias, 1/s^2.
    pub invariant_bias_gain: f64,
    /// Largest rate the gyro can read, rad/s (2000 deg/s is common).
    pub gyro_limit_rad_s: f64,
    /// Longer time steps are gaps: the gyro cannot have seen the turn, seconds.
    pub max_gap_s: f64,
}

/// pi / 180
const DEG: f64 = std::f64::consts::PI / 180.0;

impl Default for AttitudeConfig {
    fn default() -> Self {
        Self {
            method: Method::Inertial,
            world: World::EastNorthUp,
            tau_accel_s: 3.0,
            tau_mag_s: 9.0,
            motion_bias: true,
            rest_bias: true,
            reject_disturbance: true,
            bias_clip_rad_s: 2.0 * DEG,
            bias_sigma_start_rad_s: 0.5 * DEG,
            bias_sigma_motion_rad_s: 0.1 * DEG,
            bias_sigma_rest_rad_s: 0.03 * DEG,
            bias_forgetting_s: 100.0,
            invariant_gain: 0.3,
            invariant_bias_gain: 0.02,
            gyro_limit_rad_s: 2000.0 * DEG,
            max_gap_s: 0.5,
        }
    }
}

impl AttitudeConfig {
    /// # Errors
    /// A value error naming the setting out of range.
    pub fn check(&self) -> Result<()> {
        checks::each(
            checks::positive,
            &[
                ("tau_accel_s", self.tau_accel_s),
                ("tau_mag_s", self.tau_mag_s),
                ("bias_clip_rad_s", self.bias_clip_rad_s),
                ("bias_sigma_start_rad_s", self.bias_sigma_start_rad_s),
                ("bias_sigma_motion_rad_s", self.bias_sigma_motion_rad_s),
                ("bias_sigma_rest_rad_s", self.bias_sigma_rest_rad_s),
                ("bias_forgetting_s", self.bias_forgetting_s),
                ("invariant_gain", self.invariant_gain),
                ("invariant_bias_gain", self.invariant_bias_gain),
                ("gyro_limit_rad_s", self.gyro_limit_rad_s),
                ("max_gap_s", self.max_gap_s),
            ],
        )?;
        Ok(())
    }
}
