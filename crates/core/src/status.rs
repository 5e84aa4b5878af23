//! What became of a frame, and why: failures are results with a reason, never a made-up pose.

use std::fmt;

/// What the tracker says of one frame: the one status of the main job.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TrackStatus {
    /// The first frame, or the first after a loss: it defines a pose, it measures none.
    Started,
    /// Measured, all directions well determined.
    Tracked,
    /// Measured, but some direction is poorly determined: see the covariance.
    Weak(Reason),
    /// Not seen, but carried by the inertial sensors: the pose is predicted, and its covariance grows.
    Coasting(Reason),
    /// Not measured: the pose is predicted and must not be taken for a measurement.
    Lost(Reason),
    /// Found again in the map after a loss.
    Relocalised,
    /// The frame was left out on purpose (a repeated image, a stamp that does not increase).
    Skipped(Reason),
}

/// Why a frame was weak, lost or skipped. The numbers are those that decided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reason {
    /// The frame has no depth image.
    NoDepth,
    /// Too few pixels have a depth; `share` of 1.
    FewKnownPixels {
        /// Share of pixels with a depth.
        share: f64,
    },
    /// Too few usable domains.
    FewDomains {
        /// How many there were.
        found: usize,
        /// How many are needed.
        needed: usize,
    },
    /// The residuals do not fit the noise model: frames do not overlap, or something large moved.
    PoorFit {
        /// Robust residual in units of the expected one.
        scale: f64,
    },
    /// Some direction of motion leaves the depth unchanged (Theorem 3).
    Unobservable {
        /// Square root of the smallest over the largest eigenvalue of the information.
        score: f64,
    },
    /// Two parts of the scene move differently: the motion is that of one of them, and the images do
    /// not say which one is the world.
    Divided {
        /// Share of the domains that follow the other motion.
        share: f64,
    },
    /// The estimated motion is larger than a camera between two frames can make.
    ImplausibleMotion {
        /// Speed found, m/s.
        speed_m_s: f64,
        /// Angular rate found, rad/s.
        rate_rad_s: f64,
    },
    /// The solve did not settle.
    NotConverged,
    /// The frame is the same image as the one before.
    DuplicateFrame,
    /// The stamp does not come after the one before.
    StampNotIncreasing,
    /// Time without frames.
    Gap {
        /// Length of the gap, seconds.
        seconds: f64,
    },
}

crate::reason_codes! {
    Reason {
        "no_depth" => NoDepth,
        "few_known_pixels" => FewKnownPixels { share },
        "few_domains" => FewDomains { found, needed },
        "poor_fit" => PoorFit { scale },
        "unobservable" => Unobservable { score },
        "divided" => Divided { share },
        "implausible_motion" => ImplausibleMotion { speed_m_s, rate_rad_s },
        "not_converged" => NotConverged,
        "duplicate_frame" => DuplicateFrame,
        "stamp_not_increasing" => StampNotIncreasing,
        "gap" => Gap { seconds },
    }
}

impl TrackStatus {
    /// True where the pose was measured or defined: such frames count as covered. A repeated image
    /// has the pose of the image that it repeats.
    pub fn has_pose(&self) -> bool {
        matches!(
            self,
            Self::Started
                | Self::Tracked
                | Self::Weak(_)
                | Self::Relocalised
                | Self::Skipped(Reason::DuplicateFrame)
        )
    }

    /// `started`, `tracked`, `weak`, `coasting`, `lost`, `relocalised` or `skipped`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Started => "started",
            Self::Tracked => "tracked",
            Self::Weak(_) => "weak",
            Self::Coasting(_) => "coasting",
            Self::Lost(_) => "lost",
            Self::Relocalised => "relocalised",
            Self::Skipped(_) => "skipped",
        }
    }

    /// The reason, where there is one.
    pub fn reason(&self) -> Option<Reason> {
        match self {
            Self::Started | Self::Tracked | Self::Relocalised => None,
            Self::Weak(reason)
            | Self::Coasting(reason)
            | Self::Lost(reason)
            | Self::Skipped(reason) => Some(*reason),
        }
    }
}

impl fmt::Display for TrackStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.reason() {
            None => write!(f, "{}", self.name()),
            Some(reason) => write!(f, "{}: {reason}", self.name()),
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoDepth => write!(f, "the frame has no depth image"),
            Self::FewKnownPixels { share } => {
                write!(f, "only {:.1} % of the pixels have a depth", 100.0 * share)
            }
            Self::FewDomains { found, needed } => {
                write!(f, "{found} usable domains, {needed} needed")
            }
            Self::PoorFit { scale } => {
                write!(
                    f,
                    "the depth does not fit a rigid motion (residual {scale:.1} times the noise)"
                )
            }
            Self::Unobservable { score } => {
                write!(
                    f,
                    "some direction of motion is not observable (score {score:.4})"
                )
            }
            Self::ImplausibleMotion {
                speed_m_s,
                rate_rad_s,
            } => {
                write!(
                    f,
                    "implausible motion of {speed_m_s:.2} m/s and {rate_rad_s:.2} rad/s"
                )
            }
            Self::Divided { share } => {
                write!(
                    f,
                    "two parts of the scene move differently ({:.0} % of the domains follow another \
                     motion)",
                    100.0 * share
                )
            }
            Self::NotConverged => write!(f, "the solve did not converge"),
            Self::DuplicateFrame => write!(f, "same image as the frame before"),
            Self::StampNotIncreasing => write!(f, "the stamp does not increase"),
            Self::Gap { seconds } => write!(f, "{seconds:.3} s without frames"),
        }
    }
}
