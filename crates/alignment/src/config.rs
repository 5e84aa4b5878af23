//! The settings of the geometric flow, with the reasons for their defaults.

use crate::Result;
use crate::noise_model::NoiseModel;
use sphereflow_core::Error;
use sphereflow_core::checks::{each, non_negative, positive, share, within};
use sphereflow_sphere::Camera;

/// How the velocity between two images is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Method {
    /// Robust solves of the weak form from coarse to fine, the second image warped by the estimate
    /// before each: exact, and for large motions.
    #[default]
    Pyramid,
    /// One robust solve on blocks of 4x4 pixels: for slow motions, in a fraction of the time.
    Single,
}

/// What the formal covariance of the solve lacks: real depth errors are correlated and distorted,
/// so that it is several times too small. `C = k^2 N^-1 + (a + b d)^2 I` per pair of images, where
/// `d` is the motion over the pair in metres (rotation times mean range added); the rotation's
/// part is divided by the mean range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CovarianceModel {
    /// k: factor on the standard deviation of the solve.
    pub scale: f64,
    /// a: what remains with no motion at all, metres.
    pub floor_m: f64,
    /// b: share of the motion, from the distortion of the depth camera; 0 for a calibrated one.
    pub motion_share: f64,
}

impl Default for CovarianceModel {
    fn default() -> Self {
        Self {
            scale: 2.0,
            floor_m: 3e-3,
            motion_share: 0.03,
        }
    }
}

/// Settings of [`crate::VelocityEstimator`] and of everything built on [`crate::Aligner`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// Side of the blocks of pixels that are averaged first, for an image [`REFERENCE_WIDTH`]
    /// pixels wide, 1 to 32; larger and smaller images have larger and smaller blocks.
    pub block: usize,
    /// Levels of blocks, each twice as wide as the one before, 1 to 6.
    pub levels: usize,
    /// Solves on the coarsest of several levels; on the others there is one.
    pub coarse_solves: usize,
    /// Further solves on the finest level.
    pub warps: usize,
    /// A block needs this share of known pixels.
    pub block_known_share: f64,
    /// Largest spread of the inverse depth within a block, as a share of its mean: more is a jump.
    pub max_jump: f64,
    /// Bend of the inverse depth across three of the finest blocks, 1/m, from which there is an edge
    /// between surfaces (or a sharp crease); counts only where the noise is well below.
    pub max_bend: f64,
    /// Number of domains wanted on the finest level; small images get fewer, of at least 4x4
    /// blocks.
    pub domains: usize,
    /// A domain needs this share of its blocks known in both images.
    pub domain_known_share: f64,
    /// Reweighted solves (Cauchy).
    pub sweeps: usize,
    /// Noise of the difference of two domain means of the inverse depth, 1/m. For structured-light
    /// cameras it hardly depends on the domain's size, as their noise is correlated.
    pub domain_noise: f64,
    /// How the noise depends on the distance.
    pub noise: NoiseModel,
    /// A robust residual up to this, in units of `domain_noise`, is never held against a motion.
    pub good_residual_scale: f64,
    /// Beyond it, the largest residual as a share of what a camera at rest would leave.
    pub max_unexplained_share: f64,
    /// Largest robust residual of any rigid motion, in units of `domain_noise`.
    pub max_residual_scale: f64,
    /// From this share of the domains on that clearly follow a second motion, the scene counts as
    /// divided. Static scenes stay below it: the distortion of a real depth camera, and a rolling
    /// shutter, draw up to some 0.2 of the domains into a feigned second motion.
    pub max_divided_share: f64,
    /// Smallest share of blocks known in both images.
    pub min_known_share: f64,
    /// Smallest number of usable domains.
    pub min_domains: usize,
    /// A score below this is [`sphereflow_core::TrackStatus::Weak`].
    pub weak_score: f64,
    /// A direction whose score is below this is not estimated at all: it takes the prior's value.
    pub unobservable_score: f64,
    /// A direction whose predicted standard deviation is above this is held at the prior too, and
    /// the status says so. Metres of motion per pair of images; infinite: no limit.
    pub max_std_m: f64,
    /// Standard deviation claimed for a direction that was not estimated, m/s.
    pub unobservable_std_m_s: f64,
    /// Faster is implausible, m/s.
    pub max_speed_m_s: f64,
    /// Faster is implausible, rad/s.
    pub max_rate_rad_s: f64,
    /// Longest time between two images that is still bridged, seconds.
    pub max_gap_s: f64,
    /// What a block's brightness counts, as a share of an independent measurement: neighbours err
    /// alike, by reflections, exposure and blur.
    pub brightness_weight: f64,
    /// From the solve's covariance to an honest one.
    pub covariance: CovarianceModel,
}

/// Width of the image that [`Config::block`] is meant for, pixels.
pub const REFERENCE_WIDTH: usize = 640;

impl Default for Config {
    fn default() -> Self {
        Self {
            block: 2,
            levels: 3,
            coarse_solves: 2,
            warps: 0,
            block_known_share: 0.8,
            max_jump: 0.12,
            max_bend: 1.5e-3,
            domains: 500,
            domain_known_share: 0.3,
            sweeps: 6,
            domain_noise: 8e-4,
            noise: NoiseModel::default(),
            good_residual_scale: 5.0,
            max_unexplained_share: 0.5,
            max_residual_scale: 20.0,
            max_divided_share: 0.2,
            min_known_share: 0.1,
            min_domains: 40,
            weak_score: 0.03,
            unobservable_score: 0.01,
            max_std_m: f64::INFINITY,
            unobservable_std_m_s: 1.0,
            max_speed_m_s: 4.0,
            max_rate_rad_s: 8.0,
            max_gap_s: 0.5,
            brightness_weight: 0.003,
            covariance: CovarianceModel::default(),
        }
    }
}

impl CovarianceModel {
    /// Of a camera whose depth was calibrated: nothing grows with the motion.
    pub fn calibrated() -> Self {
        Self {
            motion_share: 0.0,
            ..Self::default()
        }
    }

    /// Of exact geometry with independent noise, as in simulations: no floor at all.
    pub fn independent() -> Self {
        Self {
            scale: 1.2,
            floor_m: 0.0,
            motion_share: 0.0,
        }
    }
}

impl Config {
    /// The defaults of a method.
    pub fn of(method: Method) -> Self {
        match method {
            Method::Pyramid => Self::default(),
            Method::Single => Self {
                block: 4,
                levels: 1,
                ..Self::default()
            },
        }
    }

    /// Side of the finest blocks for the images of `camera`, pixels. They divide the image of the
    /// whole sphere, which has no border to drop a rest at.
    pub fn block_for(&self, camera: &Camera) -> usize {
        let width = camera.width() as f64 / REFERENCE_WIDTH as f64;
        let wanted = (self.block as f64 * width).round().clamp(1.0, 32.0) as usize;
        let fits = |block: &usize| camera.binned(*block).is_ok();
        (1..=wanted).rev().find(fits).unwrap_or(1)
    }

    /// Checks every setting.
    ///
    /// # Errors
    /// A core value error naming the first setting out of its range.
    pub fn validate(&self) -> Result<()> {
        let counts = [
            ("block", self.block, 1, 32),
            ("domains", self.domains, 1, 100_000),
            ("sweeps", self.sweeps, 0, 100),
            ("warps", self.warps, 0, 20),
            ("levels", self.levels, 1, 6),
            ("coarse_solves", self.coarse_solves, 1, 20),
            ("min_domains", self.min_domains, 6, 100_000),
        ];
        for (name, value, low, high) in counts {
            within(name, value, low..=high)?;
        }
        let shares = [
            ("block_known_share", self.block_known_share),
            ("max_jump", self.max_jump),
            ("domain_known_share", self.domain_known_share),
            ("max_unexplained_share", self.max_unexplained_share),
            ("max_divided_share", self.max_divided_share),
            ("min_known_share", self.min_known_share),
            ("brightness_weight", self.brightness_weight),
            ("weak_score", self.weak_score),
            ("unobservable_score", self.unobservable_score),
            ("covariance.motion_share", self.covariance.motion_share),
        ];
        each(share, &shares)?;
        let sizes = [
            ("max_bend", self.max_bend),
            ("domain_noise", self.domain_noise),
            ("good_residual_scale", self.good_residual_scale),
            ("max_residual_scale", self.max_residual_scale),
            ("unobservable_std_m_s", self.unobservable_std_m_s),
            ("max_speed_m_s", self.max_speed_m_s),
            ("max_rate_rad_s", self.max_rate_rad_s),
            ("max_gap_s", self.max_gap_s),
            ("covariance.scale", self.covariance.scale),
        ];
        each(positive, &sizes)?;
        self.noise.validate()?;
        if self.max_std_m.is_nan() || self.max_std_m <= 0.0 {
            let expected = "a positive number of metres, or infinity";
            return Err(Error::value("max_std_m", expected, self.max_std_m));
        }
        non_negative("covariance.floor_m", self.covariance.floor_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn config_default_is_valid() {
        assert!(Config::default().validate().is_ok());
    }

    #[test]
    fn config_out_of_range_names_the_setting() {
        let bad = [
            (
                Config {
                    block: 0,
                    ..Config::default()
                },
                "block",
            ),
            (
                Config {
                    max_gap_s: f64::NAN,
                    ..Config::default()
                },
                "max_gap_s",
            ),
            (
                Config {
                    max_jump: 2.0,
                    ..Config::default()
                },
                "max_jump",
            ),
        ];
        for (config, name) in bad {
            let error = config.validate().unwrap_err().to_string();
            assert!(error.starts_with(name), "{error}");
        }
    }
}
