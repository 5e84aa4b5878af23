//! The settings of the thesis's method.

use crate::Result;
use sphereflow_alignment::Config;
use sphereflow_core::checks::within;

/// Where in time the contour integrals of (6.3) are taken, against the difference of both images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TimeRule {
    /// At the first image: of first order in the time between the images.
    Forward,
    /// The mean of both images: of second order.
    #[default]
    Trapezoid,
}

/// What each domain's equation weighs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RowWeights {
    /// The same: plain least squares, as the thesis ran it. Volumes go with D^3, so that the far
    /// walls rule.
    #[default]
    Equal,
    /// One over the variance that equal noise of the inverse depth gives a domain's volume.
    DomainNoise,
}

/// Settings of [`super::ThesisEstimator`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThesisConfig {
    /// Number of domains wanted, 6 to 100000: Table 6.1 has 40 to 1000. The image is tiled by about
    /// as many rectangles of about equal sides, each of at least 4x4 pixels.
    pub domains: usize,
    /// Rectangles twice as wide and high, each overlapping its neighbours by half, in place of a
    /// tiling.
    pub overlap: bool,
    /// Time rule of (6.3).
    pub time: TimeRule,
    /// Weights of the equations.
    pub weights: RowWeights,
    /// Smallest number of domains without a hole, 7 or more.
    pub min_domains: usize,
    /// What the status is judged by: known share, noise of a domain, residuals, scores, speeds. The
    /// settings for the solve of the engine's own method have no effect.
    pub limits: Config,
}

impl Default for ThesisConfig {
    fn default() -> Self {
        Self {
            domains: 200,
            overlap: false,
            time: TimeRule::default(),
            weights: RowWeights::default(),
            min_domains: 12,
            limits: Config::default(),
        }
    }
}

impl ThesisConfig {
    /// Checks every setting.
    ///
    /// # Errors
    /// A core value error naming the first setting out of its range.
    pub fn validate(&self) -> Result<()> {
        within("domains", self.domains, 6..=100_000)?;
        within("min_domains", self.min_domains, 7..=100_000)?;
        self.limits.validate()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn config_out_of_range_names_the_setting() {
        assert!(ThesisConfig::default().validate().is_ok());
        let few = ThesisConfig {
            domains: 5,
            ..ThesisConfig::default()
        };
        assert!(
            few.validate()
                .unwrap_err()
                .to_string()
                .starts_with("domains")
        );
        let few = ThesisConfig {
            min_domains: 6,
            ..ThesisConfig::default()
        };
        let error = few.validate().unwrap_err().to_string();
        assert!(error.starts_with("min_domains"), "{error}");
    }
}
