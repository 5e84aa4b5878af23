//! What became of a sample, and why: failures are results with a reason, never a made-up state.

use sphereflow_core::{ReasonField, ReasonValue};
use std::fmt;

/// Which sensor a reason speaks of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensor {
    /// Angular rate.
    Gyro,
    /// Specific force.
    Accel,
    /// Magnetic field.
    Mag,
    /// Linear and angular velocity from images.
    Velocity,
    /// Pose from vision.
    Pose,
    /// The assurance that nothing moves.
    ZeroVelocity,
    /// Brightness and range images.
    Image,
}

/// What an observer says of its state after a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Status {
    /// Not settled yet: the reason says what is waited for.
    Starting(Reason),
    /// All is well.
    Ok,
    /// The state is told, but something about it is poorly known: the reason says what.
    Weak(Reason),
    /// The sample was left out; the state is the prediction without it.
    Skipped(Reason),
}

/// Why. The numbers are those that decided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reason {
    /// Nothing was measured yet.
    NoData,
    /// Settling for so long yet.
    Settling {
        /// Seconds left.
        seconds: f64,
    },
    /// A number is not finite.
    NotFinite {
        /// Of which sensor.
        sensor: Sensor,
    },
    /// A number that no such sensor reads.
    OutOfRange {
        /// Of which sensor.
        sensor: Sensor,
        /// Largest component found, in the sensor's unit.
        found: f64,
        /// The largest that is believed.
        limit: f64,
    },
    /// A single reading that jumps away from the one before.
    Spike {
        /// Of which sensor.
        sensor: Sensor,
        /// By how much, in the sensor's unit.
        found: f64,
        /// What is believed at once.
        limit: f64,
    },
    /// A covariance that is not symmetric positive definite, or beyond all bounds.
    BadCovariance {
        /// Of which measurement.
        sensor: Sensor,
    },
    /// An axis reads one and the same number while the others change.
    DeadAxis {
        /// Of which sensor.
        sensor: Sensor,
        /// 0, 1 or 2.
        axis: usize,
    },
    /// The sensor reads its limit.
    Saturated {
        /// Of which sensor.
        sensor: Sensor,
        /// Largest component found, in the sensor's unit.
        found: f64,
    },
    /// The accelerometer reads about 1 at rest: it is given in g instead of m/s^2.
    AccelInG {
        /// Mean norm found.
        norm: f64,
    },
    /// The accelerometer's mean norm is not that of gravity.
    AccelNorm {
        /// Mean norm found, m/s^2.
        norm: f64,
    },
    /// The stamp does not come after the one before, or the time step is not above zero.
    StampNotIncreasing,
    /// Time without samples.
    Gap {
        /// Its length.
        seconds: f64,
    },
    /// The sample is older than the filter can go back.
    TooLate {
        /// How late, seconds.
        seconds: f64,
    },
    /// The magnetic field differs from the one that the heading rests on.
    MagneticDisturbance,
    /// Without a magnetometer the heading is that of the start, and drifts.
    NoMagnetometer,
    /// A measurement further from the prediction than both can explain.
    Gated {
        /// Of which sensor.
        sensor: Sensor,
        /// Squared distance in units of its covariance.
        distance: f64,
        /// What would have passed.
        limit: f64,
    },
    /// Nothing but integration for so long: the covariance grows.
    Coasting {
        /// Seconds since the last position or velocity.
        seconds: f64,
    },
    /// Directions of the state that the motion so far has not shown.
    Unobservable {
        /// How many.
        directions: usize,
    },
    /// A recording that should be at rest moves.
    NotStill,
    /// The time offset is not told: the motion is too even, or the offset lies beyond the search.
    OffsetUnclear,
    /// Too few pixels could be used; `share` of 1.
    FewPixels {
        /// Share of pixels used.
        share: f64,
    },
}

sphereflow_core::reason_codes! {
    Reason {
        "no_data" => NoData,
        "settling" => Settling { seconds },
        "not_finite" => NotFinite { sensor },
        "out_of_range" => OutOfRange { sensor, found, limit },
        "spike" => Spike { sensor, found, limit },
        "bad_covariance" => BadCovariance { sensor },
        "dead_axis" => DeadAxis { sensor, axis },
        "saturated" => Saturated { sensor, found },
        "accel_in_g" => AccelInG { norm },
        "accel_norm" => AccelNorm { norm },
        "stamp_not_increasing" => StampNotIncreasing,
        "gap" => Gap { seconds },
        "too_late" => TooLate { seconds },
        "magnetic_disturbance" => MagneticDisturbance,
        "no_magnetometer" => NoMagnetometer,
        "gated" => Gated { sensor, distance, limit },
        "coasting" => Coasting { seconds },
        "unobservable" => Unobservable { directions },
        "not_still" => NotStill,
        "offset_unclear" => OffsetUnclear,
        "few_pixels" => FewPixels { share },
    }
}

/// A sensor's word in a reason's values.
impl ReasonField for Sensor {
    fn value(&self) -> ReasonValue {
        ReasonValue::Word(self.code().into())
    }

    fn of(value: &ReasonValue) -> Option<Self> {
        let ReasonValue::Word(word) = value else {
            return None;
        };
        Self::ALL.into_iter().find(|sensor| sensor.code() == word)
    }
}

impl Sensor {
    /// Every sensor.
    pub const ALL: [Self; 7] = [
        Self::Gyro,
        Self::Accel,
        Self::Mag,
        Self::Velocity,
        Self::Pose,
        Self::ZeroVelocity,
        Self::Image,
    ];

    /// `gyro`, `accel`, `mag`, `velocity`, `pose`, `zero_velocity` or `image`.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Gyro => "gyro",
            Self::Accel => "accel",
            Self::Mag => "mag",
            Self::Velocity => "velocity",
            Self::Pose => "pose",
            Self::ZeroVelocity => "zero_velocity",
            Self::Image => "image",
        }
    }
}

impl Status {
    /// `starting`, `ok`, `weak` or `skipped`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Starting(_) => "starting",
            Self::Ok => "ok",
            Self::Weak(_) => "weak",
            Self::Skipped(_) => "skipped",
        }
    }

    /// The reason, where there is one.
    pub fn reason(&self) -> Option<Reason> {
        match self {
            Self::Ok => None,
            Self::Starting(r) | Self::Weak(r) | Self::Skipped(r) => Some(*r),
        }
    }

    /// True where the sample was used.
    pub fn is_used(&self) -> bool {
        !matches!(self, Self::Skipped(_))
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.reason() {
            None => write!(f, "{}", self.name()),
            Some(reason) => write!(f, "{}: {reason}", self.name()),
        }
    }
}

impl fmt::Display for Sensor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Gyro => "gyro",
            Self::Accel => "accelerometer",
            Self::Mag => "magnetometer",
            Self::Velocity => "velocity",
            Self::Pose => "pose",
            Self::ZeroVelocity => "zero velocity",
            Self::Image => "image",
        })
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoData => write!(f, "nothing was measured yet"),
            Self::Settling { seconds } => write!(f, "settling for another {seconds:.1} s"),
            Self::NotFinite { sensor } => write!(f, "{sensor}: a number is not finite"),
            Self::OutOfRange {
                sensor,
                found,
                limit,
            } => write!(
                f,
                "{sensor}: {found:.3e} is beyond what such a sensor reads, {limit:.3e}"
            ),
            Self::Spike {
                sensor,
                found,
                limit,
            } => write!(
                f,
                "{sensor}: a jump by {found:.3}, at most {limit:.3} is believed at once"
            ),
            Self::BadCovariance { sensor } => write!(
                f,
                "{sensor}: the covariance is not positive definite within 1e-9 to 1e9 (standard deviations)"
            ),
            Self::DeadAxis { sensor, axis } => {
                let name = ["x", "y", "z"].get(*axis).unwrap_or(&"?");
                write!(f, "{sensor}: axis {name} never changes while the others do")
            }
            Self::Saturated { sensor, found } => {
                write!(f, "{sensor}: {found:.3} is at the limit of its range")
            }
            Self::AccelInG { norm } => write!(
                f,
                "accelerometer: mean norm {norm:.3}, expected 9.81 m/s^2: given in g?"
            ),
            Self::AccelNorm { norm } => {
                write!(f, "accelerometer: mean norm {norm:.3}, expected 9.81 m/s^2")
            }
            Self::StampNotIncreasing => write!(f, "the stamp does not increase"),
            Self::Gap { seconds } => write!(f, "{seconds:.3} s without samples"),
            Self::TooLate { seconds } => {
                write!(f, "{seconds:.3} s late, more than the filter goes back")
            }
            Self::MagneticDisturbance => {
                write!(
                    f,
                    "magnetometer: the field is not the one the heading rests on"
                )
            }
            Self::NoMagnetometer => {
                write!(f, "no magnetometer: the heading is relative and drifts")
            }
            Self::Gated {
                sensor,
                distance,
                limit,
            } => write!(
                f,
                "{sensor}: squared distance {distance:.1} from the prediction, at most {limit:.1} is explained"
            ),
            Self::Coasting { seconds } => {
                write!(
                    f,
                    "{seconds:.2} s without position or velocity: integrating"
                )
            }
            Self::Unobservable { directions } => write!(
                f,
                "{directions} direction(s) of the state are not observable from the motion so far"
            ),
            Self::NotStill => write!(f, "the recording is not at rest"),
            Self::OffsetUnclear => write!(
                f,
                "the time offset is not clear: too even a motion, or beyond the offsets tried"
            ),
            Self::FewPixels { share } => {
                write!(f, "only {:.1} % of the pixels can be used", 100.0 * share)
            }
        }
    }
}
