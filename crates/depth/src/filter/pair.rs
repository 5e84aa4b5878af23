//! The new image and one of the past.

use super::lattice::Lattice;
use super::prepare::Prepared;
use super::state::Drift;
use super::step::Step;

/// Two images and what lies between them.
pub(super) struct Pair<'a> {
    pub lattice: &'a Lattice,
    /// From the new camera to the past one.
    pub step: Step,
    pub new: &'a Prepared,
    pub past: &'a Prepared,
    /// The surface seen in the past image, 0 where not well known; empty to hide nothing.
    pub surface: &'a [f32],
    /// New brightness over past brightness, per row of the new image.
    pub gain: Vec<f32>,
    /// Share of what each row says of its ranges that the gain could not explain as well.
    pub told: Vec<f32>,
    /// Uncertainty of the step.
    pub drift: Drift,
    /// Frames to the past image.
    pub lag: usize,
    /// Images, not yet forgotten, that have been compared with the past one in this pair's role: its noise is the
    /// same for all of them.
    pub repeats: f32,
}
