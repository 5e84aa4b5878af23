//! When two inverse ranges are of one surface: every such threshold, as shares of the inverse range zeta.
//!
//! Smaller values split surfaces that slope or are noisy; larger ones join what lies behind each other, so that
//! edges are washed out. All were chosen on simulated rooms; none depends on the scene's size.

/// What noise makes the zeta of neighbouring pixels differ by.
const SAME_SURFACE: f32 = 0.007;

/// Surfaces whose zeta, continued to one place, differs by less than this are one.
pub(super) const ONE_SURFACE: f64 = 0.02;

/// Neighbours whose zeta bends by more than this lie beside a depth edge.
pub(super) const EDGE: f32 = 0.06;

/// Zeta of a past surface over a pixel's own, from which on it hides the pixel.
pub(super) const HIDES: f32 = 1.06;

/// A pixel that should have been where another frame shows a surface so much nearer or farther was hidden there.
pub(super) const OTHER_SURFACE: f32 = 0.1;

/// A surface whose zeta changes by less than this share of itself per radian is a slope, and not two surfaces.
pub(super) const SLOPE_PER_RAD: f32 = 2.75;

/// The difference up to which neighbours are of one surface: noise, and a slope over a pixel. `focal_px` is pixels
/// per radian.
pub(super) fn same_surface(focal_px: f32) -> f32 {
    SAME_SURFACE + SLOPE_PER_RAD / focal_px
}
