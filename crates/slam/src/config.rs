//! The settings of the keyframe graph.

use sphereflow_core::{Result, checks};

/// Which pairs of keyframes are compared, and how far the comparison is trusted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GraphConfig {
    /// False keeps no keyframe images: the poses stay as they were measured.
    pub enabled: bool,
    /// Pairs turned by more than this are not compared, radians.
    pub max_angle_rad: f64,
    /// Pairs further apart are not compared, metres.
    pub max_distance_m: f64,
    /// Pairs that share less of their surface are not compared.
    pub min_overlap: f64,
    /// Largest number of earlier keyframes that one is compared with: those of most overlap.
    pub max_edges: usize,
    /// Standard deviations of a comparison beyond what its residuals show, metres.
    pub floor_m: f64,
    /// The same for rotations, radians.
    pub floor_rad: f64,
    /// Rounds of comparing and solving.
    pub rounds: usize,
}

impl Default for GraphConfig {
    fn default() -> Self {
        Self {
            enabled: true,
            max_angle_rad: 0.6,
            max_distance_m: 0.8,
            min_overlap: 0.3,
            max_edges: 30,
            floor_m: 4e-3,
            floor_rad: 3e-3,
            rounds: 2,
        }
    }
}

impl GraphConfig {
    /// Checks every setting.
    ///
    /// # Errors
    /// A core value error naming the first setting out of its range.
    pub fn validate(&self) -> Result<()> {
        checks::share("min_overlap", self.min_overlap)?;
        checks::within("max_edges", self.max_edges, 0..=10_000)?;
        checks::within("rounds", self.rounds, 0..=100)?;
        checks::each(
            checks::positive,
            &[
                ("max_angle_rad", self.max_angle_rad),
                ("max_distance_m", self.max_distance_m),
                ("floor_m", self.floor_m),
                ("floor_rad", self.floor_rad),
            ],
        )
    }
}
