//! Settings of the TV-L1 flow, and which of them follow the images' noise.

use crate::{Error, Result};
use sphereflow_core::checks::{positive, within};

/// Settings of [`crate::TvL1Flow`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TvL1Config {
    /// Weight alpha^2 of the data, per grey level; `None` for 0.25, less by the noise.
    pub lambda: Option<f32>,
    /// 1/(2 beta^2): how freely the flow that fits the data may leave the smooth one. The smooth one then
    /// sees a data term that is square for small residuals, so that noise is not fitted; zero is the
    /// absolute value itself. `None` for 0.2, more by the noise.
    pub split: Option<f32>,
    /// Linearisations per pyramid level.
    pub warps: usize,
    /// Primal-dual iterations per linearisation.
    pub iterations: usize,
    /// Pyramid levels, each half as large; fewer where the image gets smaller than 16 pixels.
    pub levels: usize,
    /// Radius of the median filter of the flow after each warp: 0 for none, else 1 or 2.
    pub median_radius: usize,
    /// Standard deviation of the Gaussian that smooths the images first, pixels; 0 for none, `None` for 0.5,
    /// more by the noise.
    pub presmooth_px: Option<f32>,
}

impl Default for TvL1Config {
    /// For a pair of images without a start.
    fn default() -> Self {
        Self {
            lambda: None,
            split: None,
            warps: 5,
            iterations: 20,
            levels: 5,
            median_radius: 1,
            presmooth_px: None,
        }
    }
}

impl TvL1Config {
    /// For a video, where each flow starts from the one before: one level, 3 warps of 20 iterations.
    pub fn warm() -> Self {
        Self {
            warps: 3,
            levels: 1,
            ..Self::default()
        }
    }

    pub(super) fn check(&self) -> Result<()> {
        let Settings {
            lambda,
            split,
            presmooth_px,
        } = self.settings(0.0);
        positive("lambda", f64::from(lambda))?;
        within("split", split, 0.0..=1e3)?;
        for (name, value) in [
            ("warps", self.warps),
            ("iterations", self.iterations),
            ("levels", self.levels),
        ] {
            if value == 0 {
                return Err(Error::value(name, "at least 1", value));
            }
        }
        within("median_radius", self.median_radius, 0..=2)?;
        within("presmooth_px", presmooth_px, 0.0..=20.0)
    }

    /// What is set, and for the rest what suits images with noise of `sigma` grey levels.
    ///
    /// The weight of an absolute residual is one over its scale: the root of the squares of the noise and
    /// of what the residual has without any. As noise becomes a larger share of that square, more of
    /// the images' finest detail is noise, and is smoothed away, and the smooth flow is held less firmly
    /// to what fits. Without noise, the settings are those of images without noise.
    pub(super) fn settings(&self, sigma: f32) -> Settings {
        let noise = (sigma * sigma - ORDINARY_NOISE * ORDINARY_NOISE).max(0.0);
        let share = noise / (noise + RESIDUAL * RESIDUAL);
        let [still, grows] = PRESMOOTH_PX.map(|px| px * px);
        Settings {
            lambda: self.lambda.unwrap_or(LAMBDA * (1.0 - share).sqrt()),
            split: self.split.unwrap_or(SPLIT * (1.0 + share)),
            presmooth_px: (self.presmooth_px).unwrap_or((still + grows * share).sqrt()),
        }
    }
}

/// The weight, coupling and smoothing of images without noise, by the Middlebury pairs.
const LAMBDA: f32 = 0.25;
const SPLIT: f32 = 0.2;

/// Smoothing without noise, and what is added to its square where all is noise, pixels.
const PRESMOOTH_PX: [f32; 2] = [0.5, 0.62];

/// Noise up to which an image counts as without: that of the pairs above, grey levels.
const ORDINARY_NOISE: f32 = 1.0;

/// Scale of the residual without noise, grey levels: by simulated and Middlebury pairs of up to twenty
/// grey levels, 1.5 to 3 do about as well.
const RESIDUAL: f32 = 2.0;

/// The settings that may follow the noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Settings {
    pub lambda: f32,
    pub split: f32,
    pub presmooth_px: f32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_without_noise_are_the_constants_and_change_steadily_with_it() {
        let config = TvL1Config::default();
        let expected = Settings {
            lambda: LAMBDA,
            split: SPLIT,
            presmooth_px: PRESMOOTH_PX[0],
        };
        assert_eq!(config.settings(0.0), expected);
        assert_eq!(config.settings(ORDINARY_NOISE), expected);
        let mut last = expected;
        for tenth in 11..300 {
            let next = config.settings(0.1 * tenth as f32);
            let ratio = last.lambda / next.lambda;
            assert!(ratio > 1.0 && ratio < 1.1, "{tenth}: {ratio}");
            assert!(next.split > last.split && next.presmooth_px > last.presmooth_px);
            last = next;
        }
        // One over the noise, in the end.
        let far = [100.0, 200.0].map(|sigma| config.settings(sigma).lambda);
        assert!((far[0] / far[1] - 2.0).abs() < 1e-3);
    }

    #[test]
    fn settings_that_are_set_stay_whatever_the_noise() {
        let config = TvL1Config {
            lambda: Some(0.07),
            split: Some(0.0),
            presmooth_px: Some(0.0),
            ..TvL1Config::warm()
        };
        assert_eq!(config.settings(0.0), config.settings(20.0));
    }
}
