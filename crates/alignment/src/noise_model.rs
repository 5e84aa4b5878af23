//! How the noise of a depth camera depends on the distance: it decides the domains' weights.

use crate::Result;
use sphereflow_core::Error;
use sphereflow_core::checks::non_negative;

/// The noise of a domain's mean over the distance. Only the dependence matters to the weights, as
/// the size is measured with every solve; it decides what counts as a good fit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum NoiseModel {
    /// Structured light and stereo: the same at all distances in the inverse depth, of
    /// [`crate::Config::domain_noise`].
    #[default]
    Disparity,
    /// Time of flight: `floor_m + share * range` in the range, which is the square of the inverse
    /// range as much in the inverse range.
    TimeOfFlight {
        /// Standard deviation of the difference of two domain means near the camera, metres.
        floor_m: f64,
        /// What comes with the range, as a share of it.
        share: f64,
    },
}

impl NoiseModel {
    /// Time of flight with the noise of common cameras: 2 mm and 0.1 % of the range.
    pub fn time_of_flight() -> Self {
        Self::TimeOfFlight {
            floor_m: 2e-3,
            share: 1e-3,
        }
    }

    /// Standard deviation of a domain's inverse range, 1/m, at the inverse range `gamma`, 1/m.
    /// `disparity` is that of a camera whose noise does not depend on the distance.
    pub fn sigma(&self, gamma: f64, disparity: f64) -> f64 {
        match self {
            Self::Disparity => disparity,
            // d(1/D) = dD / D^2
            Self::TimeOfFlight { floor_m, share } => gamma * (floor_m * gamma + share),
        }
    }

    /// The same in units of `disparity`, at least [`LEAST`]: no domain may rule the others.
    pub(crate) fn relative(&self, gamma: f64, disparity: f64) -> f64 {
        match self {
            Self::Disparity => 1.0,
            Self::TimeOfFlight { .. } => (self.sigma(gamma, disparity) / disparity).max(LEAST),
        }
    }

    /// Checks the numbers.
    ///
    /// # Errors
    /// A core value error naming the number.
    pub fn validate(&self) -> Result<()> {
        let Self::TimeOfFlight { floor_m, share } = *self else {
            return Ok(());
        };
        non_negative("noise.floor_m", floor_m)?;
        non_negative("noise.share", share)?;
        if floor_m + share == 0.0 {
            return Err(Error::value("noise", "some noise", "none"));
        }
        Ok(())
    }
}

/// Smallest noise in units of the default one: walls beyond some 20 m look free of noise to the
/// model, but calibration is not that good.
const LEAST: f64 = 0.05;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sigma_of_time_of_flight_is_that_of_the_range_carried_over() {
        let (floor_m, share) = (4e-3, 2e-3);
        let model = NoiseModel::TimeOfFlight { floor_m, share };
        for range in [0.5, 1.0, 3.0, 8.0] {
            let std_m = floor_m + share * range;
            let step = 1e-6;
            let slope = (1.0 / range - 1.0 / (range + step)) / step;
            let sigma = model.sigma(1.0 / range, 8e-4);
            // a forward difference of 1/D
            assert!((sigma / (slope * std_m) - 1.0).abs() < 1e-5, "{range}");
        }
        assert_eq!(NoiseModel::Disparity.relative(0.3, 8e-4), 1.0);
    }

    #[test]
    fn noise_model_with_bad_numbers_names_them() {
        for (floor_m, share, name) in [
            (-1.0, 0.0, "noise.floor_m"),
            (0.0, f64::NAN, "noise.share"),
            (0.0, 0.0, "noise"),
        ] {
            let model = NoiseModel::TimeOfFlight { floor_m, share };
            let error = model.validate().unwrap_err().to_string();
            assert!(error.starts_with(name), "{error}");
        }
    }
}
