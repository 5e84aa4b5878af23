//! The settings of the point-wise range flow, with the reasons for their defaults.

use crate::Result;
use sphereflow_alignment::CovarianceModel;
use sphereflow_core::Error;
use sphereflow_core::checks::{each, non_negative, positive, share, within};
use sphereflow_sphere::Camera;

/// Settings of [`crate::RangeFlow`].
#[derive(Clone, Debug, PartialEq)]
pub struct RangeFlowConfig {
    /// Sides of the blocks of pixels that are averaged, one solve each, coarse to fine. The equation
    /// needs gradients, whose noise grows as the blocks shrink and biases the result towards zero:
    /// 4 is as fine as a Kinect's noise allows.
    pub levels: Vec<usize>,
    /// A block needs this share of known pixels.
    pub block_known_share: f64,
    /// Largest difference of neighbouring blocks, and spread within one, over the mean: more is a
    /// jump, across which there is no gradient.
    pub max_jump: f64,
    /// Reweighted solves (Cauchy) on each level.
    pub sweeps: usize,
    /// Noise of the difference of two block means of the inverse depth, 1/m.
    pub block_noise: f64,
    /// A robust residual up to this, in units of `block_noise`, is never held against a motion.
    pub good_residual_scale: f64,
    /// Beyond it, the largest residual as a share of what a camera at rest would leave.
    pub max_unexplained_share: f64,
    /// Largest robust residual of any rigid motion, in units of `block_noise`.
    pub max_residual_scale: f64,
    /// Smallest share of blocks known in both images.
    pub min_known_share: f64,
    /// Smallest number of blocks with a gradient.
    pub min_blocks: usize,
    /// A score below this is [`sphereflow_core::TrackStatus::Weak`].
    pub weak_score: f64,
    /// A direction whose score is below this is not estimated at all.
    pub unobservable_score: f64,
    /// Standard deviation claimed for a direction that was not estimated, m/s.
    pub unobservable_std_m_s: f64,
    /// Faster is implausible, m/s.
    pub max_speed_m_s: f64,
    /// Faster is implausible, rad/s.
    pub max_rate_rad_s: f64,
    /// From the solve's covariance to an honest one.
    pub covariance: CovarianceModel,
}

impl Default for RangeFlowConfig {
    fn default() -> Self {
        Self {
            levels: vec![16, 8, 4],
            block_known_share: 0.8,
            max_jump: 0.12,
            sweeps: 6,
            block_noise: 1.5e-3,
            good_residual_scale: 5.0,
            max_unexplained_share: 0.5,
            max_residual_scale: 20.0,
            min_known_share: 0.1,
            min_blocks: 40,
            weak_score: 0.03,
            unobservable_score: 0.01,
            unobservable_std_m_s: 1.0,
            max_speed_m_s: 4.0,
            max_rate_rad_s: 8.0,
            covariance: CovarianceModel::default(),
        }
    }
}

/// Largest side of a block, pixels.
const MAX_BLOCK: usize = 32;

impl RangeFlowConfig {
    /// Checks every setting, and the levels against the image of `camera`.
    ///
    /// # Errors
    /// A core value error naming the first setting out of its range.
    pub fn validate(&self, camera: &Camera) -> Result<()> {
        self.validate_levels(camera)?;
        let shares = [
            ("block_known_share", self.block_known_share),
            ("max_jump", self.max_jump),
            ("max_unexplained_share", self.max_unexplained_share),
            ("min_known_share", self.min_known_share),
            ("weak_score", self.weak_score),
            ("unobservable_score", self.unobservable_score),
            ("covariance.motion_share", self.covariance.motion_share),
        ];
        each(share, &shares)?;
        let sizes = [
            ("block_noise", self.block_noise),
            ("good_residual_scale", self.good_residual_scale),
            ("max_residual_scale", self.max_residual_scale),
            ("unobservable_std_m_s", self.unobservable_std_m_s),
            ("max_speed_m_s", self.max_speed_m_s),
            ("max_rate_rad_s", self.max_rate_rad_s),
            ("covariance.scale", self.covariance.scale),
        ];
        each(positive, &sizes)?;
        non_negative("covariance.floor_m", self.covariance.floor_m)
    }

    fn validate_levels(&self, camera: &Camera) -> Result<()> {
        let name = "levels";
        if self.levels.is_empty() {
            return Err(Error::value(name, "one block size at least", "none"));
        }
        if self.min_blocks < 6 {
            return Err(Error::value("min_blocks", "6 or more", self.min_blocks));
        }
        within("sweeps", self.sweeps, 1..=100)?;
        for &block in &self.levels {
            let (width, height) = (camera.width(), camera.height());
            let inner = |side: usize| (side / block.max(1)).saturating_sub(2);
            if !(1..=MAX_BLOCK).contains(&block) {
                let expected = format!("blocks of 1 to {MAX_BLOCK} pixels");
                return Err(Error::value(name, expected, block));
            }
            if inner(width) * inner(height) < self.min_blocks {
                let expected = format!(
                    "blocks that leave {} with neighbours in {width}x{height} pixels",
                    self.min_blocks
                );
                return Err(Error::value(name, expected, block));
            }
        }
        if self.levels.windows(2).any(|pair| pair[0] < pair[1]) {
            let found = format!("{:?}", self.levels);
            return Err(Error::value(name, "coarse to fine", found));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(config: &RangeFlowConfig) -> String {
        let camera = Camera::pinhole(290.0, 290.0, 159.5, 119.5, 320, 240).unwrap();
        config.validate(&camera).unwrap_err().to_string()
    }

    #[test]
    fn range_flow_config_default_is_valid_for_a_small_image() {
        let camera = Camera::pinhole(290.0, 290.0, 159.5, 119.5, 320, 240).unwrap();
        assert!(RangeFlowConfig::default().validate(&camera).is_ok());
    }

    #[test]
    fn range_flow_config_bad_levels_name_levels() {
        for levels in [vec![], vec![4, 8], vec![0], vec![64]] {
            let config = RangeFlowConfig {
                levels,
                ..RangeFlowConfig::default()
            };
            let error = refusal(&config);
            assert!(error.starts_with("levels"), "{error}");
        }
    }

    #[test]
    fn range_flow_config_out_of_range_names_the_setting() {
        let config = RangeFlowConfig {
            max_jump: f64::NAN,
            ..RangeFlowConfig::default()
        };
        assert!(refusal(&config).starts_with("max_jump"));
    }
}
