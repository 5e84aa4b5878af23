//! Settings of the navigation filter.

use crate::Result;
use crate::imu_noise;
use nalgebra::Vector3;
use sphereflow_core::{Error, Pose, checks};

/// Settings of [`super::NavigationFilter`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NavigationConfig {
    /// Gravity itself in the world, m/s^2.
    pub gravity_m_s2: Vector3<f64>,
    /// Where the camera, whose poses and velocities come in, sits on the body (the IMU).
    pub body_from_camera: Pose,
    /// Of one gyro reading, rad/s.
    pub gyro_sigma_rad_s: f64,
    /// Of one accelerometer reading, m/s^2.
    pub accel_sigma_m_s2: f64,
    /// rad/s/sqrt(s).
    pub gyro_walk: f64,
    /// m/s^2/sqrt(s).
    pub accel_walk: f64,
    /// Of the gyro's bias at the start, rad/s.
    pub gyro_bias_sigma: f64,
    /// Of the accelerometer's bias at the start, m/s^2.
    pub accel_bias_sigma: f64,
    /// Of the heading from one magnetometer reading, rad; readings closer than 0.1 s are left out.
    pub mag_heading_sigma_rad: f64,
    /// So late may a sample come, seconds.
    pub max_delay_s: f64,
    /// Longer steps between inertial readings are gaps, seconds.
    pub max_gap_s: f64,
    /// A velocity (3 degrees of freedom) beyond this squared distance is left out.
    pub velocity_gate: f64,
    /// A pose (6 degrees of freedom) beyond this squared distance is left out.
    pub pose_gate: f64,
    /// After so long of nothing but rejected poses the filter doubts itself, seconds.
    pub patience_s: f64,
    /// Largest rate the gyro can read, rad/s.
    pub gyro_limit_rad_s: f64,
}

impl Default for NavigationConfig {
    fn default() -> Self {
        Self {
            gravity_m_s2: Vector3::new(0.0, 9.81, 0.0),
            body_from_camera: Pose::identity(),
            gyro_sigma_rad_s: imu_noise::gyro_sigma(),
            accel_sigma_m_s2: imu_noise::accel_sigma(),
            gyro_walk: imu_noise::GYRO_WALK,
            accel_walk: imu_noise::ACCEL_WALK,
            gyro_bias_sigma: 0.03,
            accel_bias_sigma: 0.2,
            mag_heading_sigma_rad: 0.2,
            max_delay_s: 0.5,
            max_gap_s: 0.1,
            velocity_gate: 25.0,
            pose_gate: 35.0,
            patience_s: 1.0,
            gyro_limit_rad_s: 34.9,
        }
    }
}

impl NavigationConfig {
    /// # Errors
    /// A value error naming the setting out of range.
    pub fn check(&self) -> Result<()> {
        checks::each(
            checks::positive,
            &[
                ("gyro_sigma_rad_s", self.gyro_sigma_rad_s),
                ("accel_sigma_m_s2", self.accel_sigma_m_s2),
                ("gyro_walk", self.gyro_walk),
                ("accel_walk", self.accel_walk),
                ("gyro_bias_sigma", self.gyro_bias_sigma),
                ("accel_bias_sigma", self.accel_bias_sigma),
                ("mag_heading_sigma_rad", self.mag_heading_sigma_rad),
                ("max_delay_s", self.max_delay_s),
                ("max_gap_s", self.max_gap_s),
                ("velocity_gate", self.velocity_gate),
                ("pose_gate", self.pose_gate),
                ("patience_s", self.patience_s),
                ("gyro_limit_rad_s", self.gyro_limit_rad_s),
                ("gravity_m_s2 (norm)", self.gravity_m_s2.norm()),
            ],
        )?;
        let lever = self.body_from_camera.translation;
        if !lever.iter().all(|v| v.is_finite()) {
            return Err(
                Error::value("body_from_camera", "finite metres", format!("{lever:?}")).into(),
            );
        }
        Ok(())
    }
}
