//! What became of a depth estimate, and why: where nothing could be seen, nothing is made up.

use std::fmt;

/// What a step of an observer, a filter or a variational method has brought.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DepthStatus {
    /// The first image, or one after a gap: there is none to compare it with, it measures nothing.
    Started,
    /// Depth was measured.
    Updated,
    /// The images are fine, but this motion shows no depth: the state is kept and carried along.
    Unobservable(DepthReason),
    /// The image cannot be used: the state is kept and carried along.
    Unusable(DepthReason),
    /// The frame was left out: the state is as before.
    Skipped(DepthReason),
}

/// Why depth was not measured. The numbers are those that decided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DepthReason {
    /// The camera moves too little for any pixel to see parallax.
    NoMotion {
        /// Longest baseline to the images in memory, metres.
        baseline_m: f64,
    },
    /// The camera turns, but does not move.
    PureRotation {
        /// Longest baseline to the images in memory, metres.
        baseline_m: f64,
    },
    /// The image is flat: black, saturated or without texture.
    NoTexture {
        /// Share of the pixels that are not saturated and have a slope, 0 to 1.
        share: f64,
    },
    /// Too few pixels are known.
    FewKnownPixels {
        /// Share of known pixels, 0 to 1.
        share: f64,
    },
    /// The stamp does not come after the one before.
    StampNotIncreasing,
    /// The images do not fit the state and the motion.
    PoorFit {
        /// Share of pixels that fit, 0 to 1.
        share: f64,
    },
}

sphereflow_core::reason_codes! {
    DepthReason {
        "no_motion" => NoMotion { baseline_m },
        "pure_rotation" => PureRotation { baseline_m },
        "no_texture" => NoTexture { share },
        "few_known_pixels" => FewKnownPixels { share },
        "stamp_not_increasing" => StampNotIncreasing,
        "poor_fit" => PoorFit { share },
    }
}

impl DepthStatus {
    /// `started`, `updated`, `unobservable`, `unusable` or `skipped`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Started => "started",
            Self::Updated => "updated",
            Self::Unobservable(_) => "unobservable",
            Self::Unusable(_) => "unusable",
            Self::Skipped(_) => "skipped",
        }
    }

    /// The reason, where there is one.
    pub fn reason(&self) -> Option<DepthReason> {
        match self {
            Self::Started | Self::Updated => None,
            Self::Unobservable(why) | Self::Unusable(why) | Self::Skipped(why) => Some(*why),
        }
    }
}

impl fmt::Display for DepthReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoMotion { baseline_m } => {
                write!(
                    f,
                    "the camera stands still (baseline {:.2} mm)",
                    1e3 * baseline_m
                )
            }
            Self::PureRotation { baseline_m } => {
                write!(
                    f,
                    "the camera only turns (baseline {:.2} mm)",
                    1e3 * baseline_m
                )
            }
            Self::NoTexture { share } => {
                write!(f, "only {:.1} % of the pixels have texture", 100.0 * share)
            }
            Self::FewKnownPixels { share } => {
                write!(f, "only {:.1} % of the pixels are known", 100.0 * share)
            }
            Self::StampNotIncreasing => write!(f, "the stamp does not increase"),
            Self::PoorFit { share } => {
                write!(
                    f,
                    "only {:.1} % of the pixels fit the motion",
                    100.0 * share
                )
            }
        }
    }
}
