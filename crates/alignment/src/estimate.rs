//! The velocity between two depth images, with its covariance and status.

use crate::Result;
use crate::align::{Aligner, Alignment, MotionPrior, Priors};
use crate::brightness::BrightnessPyramid;
use crate::config::Config;
use crate::depth_image::DepthImage;
use crate::motion::{pose_from_twist, twist_from_pose};
use crate::observability::WeakDirection;
use crate::pair_input::PairInput;
use crate::pyramid::FramePyramid;
use nalgebra::Matrix6;
use sphereflow_core::{Error, Plane, Pose, Reason, TrackStatus, Twist};
use sphereflow_sphere::Camera;

/// What two depth images say of the camera's velocity.
#[derive(Clone, Debug, PartialEq)]
pub struct VelocityEstimate {
    /// `Tracked`, `Weak` with a reason, or `Lost` with a reason.
    pub status: TrackStatus,
    /// Velocity in the camera's own frame, constant between the images: `log(R, p) / dt` of the
    /// motion `first_from_second`. `None` where lost.
    pub twist: Option<Twist>,
    /// Covariance of the twist in the order `[omega, v]`, with [`crate::CovarianceModel`] applied.
    /// `None` where lost.
    ///
    /// Thesis: section 6.4
    pub covariance: Option<Matrix6<f64>>,
    /// 0 (some direction of motion changes nothing) to 1; square root of smallest over largest
    /// eigenvalue of the information, rotations scaled by the mean range.
    ///
    /// Thesis: Theorem 3
    pub score: f64,
    /// Directions below [`Config::weak_score`] or beyond [`Config::max_std_m`].
    pub weak_directions: Vec<WeakDirection>,
    /// Share of blocks known in both images, 0 to 1.
    pub known_share: f64,
    /// Share of the first image's surface within the second, 0 to 1; NaN where nothing was solved.
    pub overlap: f64,
    /// Median displacement of the pixels; NaN where nothing was solved.
    pub flow_px: f64,
    /// Share of the domains that do not move with the rest: moving objects and what they hide.
    pub rejected_share: f64,
    /// Share of the domains that clearly follow one other rigid motion rather than the one found:
    /// a large moving object, or the world behind it. From [`Config::max_divided_share`] on the
    /// status is weak; the covariance reaches to both motions.
    pub divided_share: f64,
    /// Usable domains.
    pub domains: usize,
    /// Robust residual in units of [`Config::domain_noise`]; NaN where nothing was solved.
    pub residual_scale: f64,
    /// Mean range of the scene, metres; NaN where nothing was solved.
    pub mean_range_m: f64,
    /// Solves of the normal equations.
    pub iterations: usize,
}

/// What is known of the velocity from another sensor, or from before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityPrior {
    /// The velocity, body frame.
    pub twist: Twist,
    /// Inverse of its covariance, order `[omega, v]`; zero rows for what is not known.
    pub information: Matrix6<f64>,
}

impl VelocityPrior {
    /// Nothing known.
    pub fn none() -> Self {
        Self {
            twist: Twist::default(),
            information: Matrix6::zeros(),
        }
    }

    /// The same with a linear velocity, body frame, of a standard deviation.
    #[must_use]
    pub fn and_linear(mut self, linear_m_s: nalgebra::Vector3<f64>, std_m_s: f64) -> Self {
        self.twist.linear_m_s = linear_m_s;
        for k in 3..6 {
            self.information[(k, k)] = 1.0 / (std_m_s * std_m_s);
        }
        self
    }

    /// A gyroscope's rate (bias removed, in the camera's frame) with its standard deviation.
    pub fn of_gyro(gyro_rad_s: nalgebra::Vector3<f64>, std_rad_s: f64) -> Self {
        let mut information = Matrix6::zeros();
        for k in 0..3 {
            information[(k, k)] = 1.0 / (std_rad_s * std_rad_s);
        }
        Self {
            twist: Twist {
                angular_rad_s: gyro_rad_s,
                ..Twist::default()
            },
            information,
        }
    }
}

/// What is known beside two depth images.
#[derive(Clone, Copy, Debug, Default)]
pub struct Also<'a> {
    /// The velocity, from another sensor.
    pub prior: Option<VelocityPrior>,
    /// Brightness of both images, 0 to 255, whose pixels see what those of the depth images do.
    pub brightness: Option<(&'a Plane<f32>, &'a Plane<f32>)>,
}

/// Velocity between two depth images of one camera.
///
/// # Errors
/// A core shape error where an image is not of the camera's size, a value error where `dt_s` is
/// not positive or a setting is out of range. Images that cannot be used are no errors: see the
/// status.
pub fn estimate_velocity<'a>(
    camera: &Camera,
    first: impl Into<DepthImage<'a>>,
    second: impl Into<DepthImage<'a>>,
    dt_s: f64,
    config: &Config,
) -> Result<VelocityEstimate> {
    VelocityEstimator::new(camera, *config)?.estimate(first, second, dt_s)
}

/// [`estimate_velocity`] for many pairs: tables and working memory are kept between calls.
///
/// Thesis: section 6.2
#[derive(Clone, Debug)]
pub struct VelocityEstimator {
    aligner: Aligner,
    first: FramePyramid,
    second: FramePyramid,
    grey: [BrightnessPyramid; 2],
}

impl VelocityEstimator {
    /// Prepares the tables of `camera`.
    ///
    /// # Errors
    /// Where a setting is out of range or the image is smaller than a block.
    pub fn new(camera: &Camera, config: Config) -> Result<Self> {
        Ok(Self {
            aligner: Aligner::new(camera, config)?,
            first: FramePyramid::default(),
            second: FramePyramid::default(),
            grey: Default::default(),
        })
    }

    /// The settings.
    pub fn config(&self) -> &Config {
        self.aligner.config()
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        self.aligner.camera()
    }

    /// Velocity between two images `dt_s` seconds apart.
    ///
    /// # Errors
    /// As [`estimate_velocity`].
    pub fn estimate<'a>(
        &mut self,
        first: impl Into<DepthImage<'a>>,
        second: impl Into<DepthImage<'a>>,
        dt_s: f64,
    ) -> Result<VelocityEstimate> {
        self.estimate_with(first, second, dt_s, &Also::default())
    }

    /// The same with what else is known.
    ///
    /// # Errors
    /// As [`estimate_velocity`], where an image of the brightness is not of the camera's size, and
    /// where the prior is not finite or its information not symmetric and positive.
    pub fn estimate_with<'a>(
        &mut self,
        first: impl Into<DepthImage<'a>>,
        second: impl Into<DepthImage<'a>>,
        dt_s: f64,
        also: &Also<'_>,
    ) -> Result<VelocityEstimate> {
        let pair = PairInput::checked(self.camera(), first, second, dt_s)?;
        if let Some(prior) = &also.prior {
            check_prior(prior)?;
        }
        let aligner = &self.aligner;
        aligner.average(&pair.first, "depth0", &mut self.first)?;
        aligner.average(&pair.second, "depth1", &mut self.second)?;
        if let Some(images) = also.brightness {
            let [first, second] = &mut self.grey;
            aligner.average_brightness(images.0, "image0", first)?;
            aligner.average_brightness(images.1, "image1", second)?;
        }
        let known = also.prior.map(|p| MotionPrior {
            keyframe_from_frame: pose_from_twist(&p.twist, dt_s),
            information: p.information / (dt_s * dt_s),
        });
        let priors = Priors {
            motion: known,
            brightness: also.brightness.map(|_| (&self.grey[0], &self.grey[1])),
            restart: true,
            ..Priors::default()
        };
        let guess = known.map_or_else(Pose::default, |known| known.keyframe_from_frame);
        let alignment = self
            .aligner
            .align(&self.first, &self.second, guess, &priors);
        let motion = alignment.motion;
        Ok(VelocityEstimate::of_alignment(
            self.config(),
            &alignment,
            &motion,
            dt_s,
        ))
    }
}

fn check_prior(prior: &VelocityPrior) -> Result<()> {
    let finite = prior.twist.vector().iter().all(|v| v.is_finite());
    let symmetric = (prior.information - prior.information.transpose()).norm()
        <= 1e-9 * prior.information.norm(); // false for NaN
    let eigenvalues = prior.information.symmetric_eigenvalues();
    let positive = eigenvalues.min() >= -1e-9 * eigenvalues.max().abs();
    if finite && symmetric && positive {
        return Ok(());
    }
    let expected = "finite velocities with a symmetric, positive information matrix";
    Err(Error::value("prior", expected, format!("{prior:?}")))
}

/// The status of an alignment, once the velocity is known too.
fn status(config: &Config, alignment: &Alignment, twist: &Twist) -> TrackStatus {
    let (speed_m_s, rate_rad_s) = (twist.linear_m_s.norm(), twist.angular_rad_s.norm());
    let implausible = speed_m_s > config.max_speed_m_s || rate_rad_s > config.max_rate_rad_s;
    match alignment.status {
        TrackStatus::Lost(Reason::PoorFit { .. }) => alignment.status,
        _ if implausible => TrackStatus::Lost(Reason::ImplausibleMotion {
            speed_m_s,
            rate_rad_s,
        }),
        _ => alignment.status,
    }
}

impl VelocityEstimate {
    /// The velocity that an alignment says, with covariance and status. `motion` is the last part of
    /// the aligned one, `dt_s` seconds long: from the frame before to this one where the first image
    /// is a keyframe, or all of it.
    pub fn of_alignment(config: &Config, alignment: &Alignment, motion: &Pose, dt_s: f64) -> Self {
        if let (TrackStatus::Lost(reason), None) = (&alignment.status, &alignment.covariance) {
            return Self::lost(*reason, alignment.known_share);
        }
        let twist = twist_from_pose(motion, dt_s);
        let status = status(config, alignment, &twist);
        let has_twist = status.has_pose();
        let covariance = alignment.velocity_covariance(config, &twist, dt_s);
        Self {
            status,
            twist: has_twist.then_some(twist),
            covariance: covariance.filter(|_| has_twist),
            score: alignment.score,
            weak_directions: alignment.weak_directions(config, dt_s),
            known_share: alignment.known_share,
            overlap: alignment.overlap,
            flow_px: alignment.flow_px,
            rejected_share: alignment.rejected_share,
            divided_share: alignment.second_motion.share,
            domains: alignment.domains,
            residual_scale: alignment.residual_scale,
            mean_range_m: alignment.mean_range_m,
            iterations: (config.sweeps + 1) * alignment.solves,
        }
    }

    /// Nothing was measured.
    pub fn lost(reason: Reason, known_share: f64) -> Self {
        Self {
            status: TrackStatus::Lost(reason),
            twist: None,
            covariance: None,
            score: 0.0,
            weak_directions: Vec::new(),
            known_share,
            overlap: f64::NAN,
            flow_px: f64::NAN,
            rejected_share: f64::NAN,
            divided_share: f64::NAN,
            domains: 0,
            residual_scale: f64::NAN,
            mean_range_m: f64::NAN,
            iterations: 0,
        }
    }
}
