//! Settings of the estimator of velocity biases.

use crate::Result;
use sphereflow_core::{Error, checks};

/// Fewer known pixels than this part of the image make no pair: so few may all lie on one surface.
pub(super) const MIN_SHARE: f64 = 0.1;

/// Which estimator answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BiasMethod {
    /// Warp by the de-biased velocities, accumulate normal equations, forget.
    #[default]
    Information,
    /// The thesis's observer with its own gains.
    Observer,
    /// The thesis's observer with gains divided by the Gram matrix of the images.
    Normalised,
}

/// Gains in the thesis's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixedGains {
    /// Correction of the estimated fields, 1/s: the printed k_y and k_D.
    pub k_field: f64,
    /// m^2/s^2: bias of the linear velocity.
    pub k_v: f64,
    /// rad m/s^2: bias of the angular velocity.
    pub k_omega: f64,
    /// Weight of the brightness.
    pub lambda_y: f64,
    /// Weight of the range, m^-2.
    pub lambda_d: f64,
}

impl Default for FixedGains {
    /// Thesis: section 5.4.3.
    fn default() -> Self {
        Self {
            k_field: 2.0,
            k_v: 1e-2,
            k_omega: 1e-5,
            lambda_y: 1.0,
            lambda_d: 5000.0,
        }
    }
}

/// Settings of [`super::VelocityBiasEstimator`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityBiasConfig {
    /// The estimator.
    pub method: BiasMethod,
    /// Gains of the observer; the normalised one takes field gain and weights from here.
    pub gains: FixedGains,
    /// Rate of the normalised observer's bias, 1/s.
    pub rate_per_s: f64,
    /// The information form forgets with this time constant, seconds.
    pub forget_s: f64,
    /// Of one measured linear velocity, m/s.
    pub linear_sigma: f64,
    /// Of one measured angular velocity, rad/s.
    pub angular_sigma: f64,
    /// Of the linear bias at the start, m/s.
    pub linear_bias_sigma: f64,
    /// Of the angular bias at the start, rad/s.
    pub angular_bias_sigma: f64,
    /// Time from the first row of an image to the last, seconds: 0 for a global shutter, negative
    /// where the last row is the first.
    pub readout_s: f64,
    /// How well stamps of images and velocities agree, seconds (standard deviation).
    pub timing_sigma_s: f64,
    /// Error of an alignment that all its pixels share, pixels of the binned image (standard
    /// deviation): lens, blur, interpolation. It changes slowly, so that the images themselves do
    /// not show it; a simulated camera has next to none.
    pub shared_error_px: f64,
    /// After longer steps the images before are of no use, seconds.
    pub max_gap_s: f64,
    /// Largest angular velocity that can be measured, rad/s (2000 deg/s is common).
    pub angular_limit_rad_s: f64,
    /// Images are binned until they are at most this wide, pixels.
    pub max_width: usize,
    /// Part of the image, from its border inwards, over which the window falls to zero.
    pub window_border: f64,
}

impl Default for VelocityBiasConfig {
    fn default() -> Self {
        Self {
            method: BiasMethod::Information,
            gains: FixedGains::default(),
            rate_per_s: 1.0,
            forget_s: 3.0,
            linear_sigma: 0.01,
            angular_sigma: 1e-3,
            linear_bias_sigma: 3.0,
            angular_bias_sigma: 0.2,
            readout_s: 0.0,
            timing_sigma_s: 0.0,
            shared_error_px: 1.5,
            max_gap_s: 0.5,
            angular_limit_rad_s: 34.9,
            max_width: 160,
            window_border: 0.15,
        }
    }
}

impl VelocityBiasConfig {
    /// # Errors
    /// A value error naming the setting out of range.
    pub fn check(&self) -> Result<()> {
        checks::each(
            checks::positive,
            &[
                ("k_field", self.gains.k_field),
                ("k_v", self.gains.k_v),
                ("k_omega", self.gains.k_omega),
                ("rate_per_s", self.rate_per_s),
                ("forget_s", self.forget_s),
                ("linear_sigma", self.linear_sigma),
                ("angular_sigma", self.angular_sigma),
                ("linear_bias_sigma", self.linear_bias_sigma),
                ("angular_bias_sigma", self.angular_bias_sigma),
                ("max_gap_s", self.max_gap_s),
                ("angular_limit_rad_s", self.angular_limit_rad_s),
                ("max_width", self.max_width as f64),
            ],
        )?;
        let not_negative = [
            ("lambda_y", self.gains.lambda_y),
            ("lambda_d", self.gains.lambda_d),
            ("timing_sigma_s", self.timing_sigma_s),
            ("shared_error_px", self.shared_error_px),
        ];
        checks::each(checks::non_negative, &not_negative)?;
        checks::within("readout_s", self.readout_s, -1.0..=1.0)?;
        if !(0.0..0.5).contains(&self.window_border) {
            let found = self.window_border;
            return Err(Error::value("window_border", "0 up to 0.5", found).into());
        }
        Ok(())
    }
}
