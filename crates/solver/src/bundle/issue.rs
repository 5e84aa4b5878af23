//! What is wrong with a problem that can still be worked on, by name.

use std::fmt;

/// Something the measurements do not determine, or a measurement that was left out.
#[derive(Clone, Debug, PartialEq)]
pub enum Issue {
    /// At the start the camera does not see the point (it is behind it, or outside the lens): the
    /// measurement is left out.
    NotSeen {
        /// Index of the observation.
        observation: usize,
        /// Index of the pose.
        pose: usize,
        /// Index of the point.
        point: usize,
    },
    /// Too few measurements for a position (one pixel without a depth, or none): the point stays
    /// where it is and its measurements are left out, because they would fit any pose.
    PointUndetermined {
        /// Index of the point.
        point: usize,
        /// Poses that see it.
        views: usize,
    },
    /// No measurement and no prior: the pose stays where it is.
    PoseUndetermined {
        /// Index of the pose.
        pose: usize,
    },
    /// The poses that move fall into groups that share no point.
    Disconnected {
        /// Number of groups.
        groups: usize,
    },
    /// A group of poses that can move as a whole without changing any residual: nothing in it is
    /// fixed. The damping holds it near its start.
    FreeGauge {
        /// The first pose of the group.
        pose: usize,
        /// Number of free directions: 7 without anything metric, else 6; 1 where only the scale is free.
        directions: usize,
    },
}

impl fmt::Display for Issue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotSeen {
                observation,
                pose,
                point,
            } => write!(
                f,
                "observation {observation} left out: pose {pose} does not see point {point} at the start"
            ),
            Self::PointUndetermined { point, views } => {
                write!(
                    f,
                    "point {point} left alone: {views} views do not determine it"
                )
            }
            Self::PoseUndetermined { pose } => {
                write!(f, "pose {pose} left alone: nothing measures it")
            }
            Self::Disconnected { groups } => {
                write!(f, "the poses fall into {groups} groups that share no point")
            }
            Self::FreeGauge { pose, directions } => write!(
                f,
                "the group of pose {pose} can move as a whole in {directions} directions"
            ),
        }
    }
}
