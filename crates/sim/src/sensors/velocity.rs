//! A velocity sensor with constant bias and white noise, as the observers of chapter 5 assume it.

use super::normals::normal3;
use crate::noise::checks;
use crate::noise::stream::{Purpose, Streams};
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use sphereflow_core::{Error, Result, Twist};

/// Parameters of [`VelocitySensor`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityParameters {
    /// Constant error of both velocities, body frame.
    pub bias: Twist,
    /// Standard deviation of each component of the angular velocity, rad/s.
    pub angular_sigma_rad_s: f64,
    /// Standard deviation of each component of the linear velocity, m/s.
    pub linear_sigma_m_s: f64,
}

impl Default for VelocityParameters {
    /// Thesis: section 5.4.3. Biases along the horizontal axis: a low-cost gyro and the wind's speed.
    fn default() -> Self {
        Self {
            bias: Twist {
                angular_rad_s: Vector3::new(0.05, 0.0, 0.0),
                linear_m_s: Vector3::new(2.5, 0.0, 0.0),
            },
            angular_sigma_rad_s: 0.005,
            linear_sigma_m_s: 0.05,
        }
    }
}

/// Reads a twist with bias and noise.
#[derive(Clone, Debug)]
pub struct VelocitySensor {
    parameters: VelocityParameters,
    rng: ChaCha8Rng,
}

impl VelocitySensor {
    /// # Errors
    /// [`Error::Value`] naming the parameter out of range.
    pub fn new(parameters: VelocityParameters, seed: u64) -> Result<Self> {
        checks::finite_all("bias.angular_rad_s", &parameters.bias.angular_rad_s)?;
        checks::finite_all("bias.linear_m_s", &parameters.bias.linear_m_s)?;
        checks::non_negative("angular_sigma_rad_s", parameters.angular_sigma_rad_s)?;
        checks::non_negative("linear_sigma_m_s", parameters.linear_sigma_m_s)?;
        Ok(Self {
            parameters,
            rng: Streams::new(seed, Purpose::Velocity, 0).chunk(0),
        })
    }

    /// The parameters.
    pub fn parameters(&self) -> &VelocityParameters {
        &self.parameters
    }

    /// The next reading of the true `twist`.
    ///
    /// # Errors
    /// [`Error::Value`] for a twist that is not finite; the sensor is then unchanged.
    pub fn sample(&mut self, twist: &Twist) -> Result<Twist> {
        if !twist.vector().iter().all(|v| v.is_finite()) {
            return Err(Error::value(
                "twist",
                "finite numbers",
                format!("{twist:?}"),
            ));
        }
        let p = &self.parameters;
        let angular_noise = normal3(&mut self.rng) * p.angular_sigma_rad_s;
        let linear_noise = normal3(&mut self.rng) * p.linear_sigma_m_s;
        Ok(Twist {
            angular_rad_s: twist.angular_rad_s + p.bias.angular_rad_s + angular_noise,
            linear_m_s: twist.linear_m_s + p.bias.linear_m_s + linear_noise,
        })
    }
}
