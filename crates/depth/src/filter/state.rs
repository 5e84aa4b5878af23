//! What the filter knows of each pixel, and what it keeps of past frames.

use super::prepare::Prepared;
use sphereflow_core::Pose;

/// Per pixel `[x, q, s, var]`: the regularised zeta (1/m), the information times the distance of
/// the unregularised mean from it, the information (m^2), and the variance of x (1/m^2).
///
/// The mean is m = x + q/s. Kept relative to x, it can be read between pixels whose information differs
/// without shifting the plane.
pub(super) type Node = [f32; 4];

/// Information left to a pixel that comes into view.
pub(super) const INFLOW: f32 = 0.01;

/// Share of information left where a surface is stretched: part of it may be another, just uncovered.
pub(super) const STRETCHED: f32 = 0.25;

/// A pixel that has just come into view, with the zeta of its neighbours as a first guess. At the
/// image's border (`weak`) the planes know better.
pub(super) fn fresh(zeta: f32, weak: bool) -> Node {
    /// Relative deviation of such a guess.
    const DEVIATION: f32 = 0.25;
    let variance = (DEVIATION * zeta).powi(2);
    let information = if weak { INFLOW } else { 1.0 } / variance;
    [zeta, 0.0, information, variance]
}

/// The zeta of a node; where it has none, that of something a kilometre away.
pub(super) fn known(zeta: f32) -> f32 {
    if zeta > 0.0 { zeta } else { 1e-3 }
}

/// A frame of the past.
#[derive(Clone, Debug)]
pub(super) struct Past {
    pub image: Prepared,
    pub world_from_camera: Pose,
    /// The zeta that was seen, 0 where it was not well known: what may hide others.
    pub surface: Vec<f32>,
    /// Covariance of this frame's pose against the next one, as the motion's sensors say: [rotation,
    /// translation] standard deviation accumulated since the start.
    pub drift: Drift,
    /// Variance of this pose by itself.
    pub noise: Drift,
}

/// Variance of a pose that is integrated from noisy velocities, accumulated since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Drift {
    /// Per axis, rad^2.
    pub rotation: f32,
    /// Per axis, m^2.
    pub translation: f32,
}

impl Drift {
    /// Variances added.
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            rotation: self.rotation + other.rotation,
            translation: self.translation + other.translation,
        }
    }

    pub fn since(&self, past: &Self) -> Self {
        Self {
            rotation: (self.rotation - past.rotation).max(0.0),
            translation: (self.translation - past.translation).max(0.0),
        }
    }
}
