//! Settings of the estimator of IMU biases.

use super::observer::ObserverGains;
use crate::Result;
use crate::imu_noise;
use sphereflow_core::checks;

/// Which estimator answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ImuBiasMethod {
    /// An extended Kalman filter on the states and measurements of (7.1).
    #[default]
    Ekf,
    /// The thesis's observer (7.4).
    Observer,
}

/// Settings of [`super::ImuBiasEstimator`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuBiasConfig {
    /// The estimator.
    pub method: ImuBiasMethod,
    /// Gains of the observer.
    pub gains: ObserverGains,
    /// Norm of gravity, m/s^2.
    pub gravity_m_s2: f64,
    /// What is known of that norm, m/s^2.
    pub gravity_sigma_m_s2: f64,
    /// Scalar product of the unit vectors of gravity (down) and of the magnetic field: the sine of
    /// the field's dip. `None`: the magnetometer is not used.
    pub field_dot_down: Option<f64>,
    /// Standard deviation of that product in a reading, 1.
    pub field_sigma: f64,
    /// Of one gyro reading, rad/s.
    pub gyro_sigma_rad_s: f64,
    /// Of one accelerometer reading, m/s^2.
    pub accel_sigma_m_s2: f64,
    /// How the gyro's bias wanders, rad/s/sqrt(s).
    pub gyro_walk: f64,
    /// How the accelerometer's bias wanders, m/s^2/sqrt(s).
    pub accel_walk: f64,
    /// Standard deviation of the gyro's bias at the start, rad/s.
    pub gyro_bias_sigma: f64,
    /// Standard deviation of the accelerometer's bias at the start, m/s^2.
    pub accel_bias_sigma: f64,
    /// Squared distance, in units of its covariance, beyond which a velocity is left out.
    pub gate: f64,
    /// Longer steps are gaps, seconds.
    pub max_gap_s: f64,
    /// Largest rate the gyro can read, rad/s (2000 deg/s is common).
    pub gyro_limit_rad_s: f64,
}

impl Default for ImuBiasConfig {
    fn default() -> Self {
        Self {
            method: ImuBiasMethod::Ekf,
            gains: ObserverGains::default(),
            gravity_m_s2: 9.81,
            gravity_sigma_m_s2: 0.005,
            field_dot_down: None,
            field_sigma: 0.02,
            gyro_sigma_rad_s: imu_noise::gyro_sigma(),
            accel_sigma_m_s2: imu_noise::accel_sigma(),
            gyro_walk: imu_noise::GYRO_WALK,
            accel_walk: imu_noise::ACCEL_WALK,
            gyro_bias_sigma: 0.1,
            accel_bias_sigma: 0.3,
            gate: 30.0,
            max_gap_s: 0.5,
            gyro_limit_rad_s: 34.9,
        }
    }
}

impl ImuBiasConfig {
    /// # Errors
    /// A value error naming the setting out of range.
    pub fn check(&self) -> Result<()> {
        checks::each(
            checks::positive,
            &[
                ("gravity_m_s2", self.gravity_m_s2),
                ("gravity_sigma_m_s2", self.gravity_sigma_m_s2),
                ("field_sigma", self.field_sigma),
                ("gyro_sigma_rad_s", self.gyro_sigma_rad_s),
                ("accel_sigma_m_s2", self.accel_sigma_m_s2),
                ("gyro_bias_sigma", self.gyro_bias_sigma),
                ("accel_bias_sigma", self.accel_bias_sigma),
                ("gate", self.gate),
                ("max_gap_s", self.max_gap_s),
                ("gyro_limit_rad_s", self.gyro_limit_rad_s),
            ],
        )?;
        let walks = [
            ("gyro_walk", self.gyro_walk),
            ("accel_walk", self.accel_walk),
        ];
        checks::each(checks::non_negative, &walks)?;
        if let Some(dot) = self.field_dot_down {
            checks::within("field_dot_down", dot, -1.0..=1.0)?;
        }
        self.gains.check()
    }
}
