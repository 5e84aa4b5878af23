//! A gyroscope beside the depth camera.

use crate::Result;
use nalgebra::Vector3;
use sphereflow_alignment::VelocityPrior;
use sphereflow_core::Error;

/// A gyroscope's mean rate between two frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gyro {
    /// Bias removed, in the camera's frame.
    pub rate_rad_s: Vector3<f64>,
    /// Standard deviation of each component; 0 holds the rotation fixed.
    pub std_rad_s: f64,
}

impl Gyro {
    pub(super) fn check(&self) -> Result<()> {
        let finite = self.rate_rad_s.iter().all(|v| v.is_finite());
        if finite && self.std_rad_s.is_finite() && self.std_rad_s >= 0.0 {
            return Ok(());
        }
        let expected = "finite rates with a standard deviation that is not negative";
        Err(Error::value("gyro", expected, format!("{self:?}")))
    }

    /// As a prior for [`sphereflow_alignment::VelocityEstimator`].
    pub fn prior(&self) -> VelocityPrior {
        VelocityPrior::of_gyro(self.rate_rad_s, self.least_std_rad_s())
    }

    /// Its standard deviation, not quite 0.
    pub(super) fn least_std_rad_s(&self) -> f64 {
        self.std_rad_s.max(LEAST_GYRO_STD)
    }
}

/// A rotation held fixed: small beside what images can tell, and far from rounding errors, rad/s.
const LEAST_GYRO_STD: f64 = 1e-5;
