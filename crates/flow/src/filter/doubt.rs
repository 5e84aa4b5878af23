//! What makes a pixel's range more or less certain than its variance says.

use super::state::Node;
use super::update::Tally;

/// How long pixels have been in view, as the pairs of an image say.
pub(super) struct Views<'a> {
    /// The least lag at which a pixel was outside the past image, frames; 0 where it always was inside.
    pub since: &'a mut [f32],
    /// Information that the image gave, m^2. Until its last pair has spoken, the information before.
    pub gained: &'a mut [f32],
}

/// Doubts of all pixels.
#[derive(Clone, Debug, Default)]
pub(super) struct Doubt {
    /// As of [`Views`], of the last image.
    since: Vec<f32>,
    gained: Vec<f32>,
    /// Squared residuals over those expected, as measured.
    misfit: f32,
}

/// Share of an image's misfit in the measure of it.
const MEMORY: f32 = 0.1;

/// Residuals do not show all errors: noise is taken for no smaller share of what is expected, as a variance.
const LEAST_MISFIT: f32 = 0.04;

/// Relative deviation up to which noise is what makes it; larger ones are doubts about the surface.
const BY_NOISE: f32 = 0.02;

/// A pixel that came into view may have gained this many times what the last image gave, by each image since.
const SLACK: f32 = 2.0;

/// Relative deviation of a pixel that is taken for a part of the surface beside it, as of planes that are continued.
const OTHER: f32 = 0.06;

impl Doubt {
    pub fn new(pixels: usize) -> Self {
        Self {
            since: vec![0.0; pixels],
            gained: vec![0.0; pixels],
            misfit: 1.0,
        }
    }

    /// Before any pair of an image has spoken.
    pub fn begin(&mut self) {
        self.since.fill(0.0);
    }

    pub fn views(&mut self) -> Views<'_> {
        Views {
            since: &mut self.since,
            gained: &mut self.gained,
        }
    }

    /// What an image's residuals say of the noise.
    pub fn learn(&mut self, tally: &Tally) {
        let misfit = tally.misfit / tally.information;
        if misfit.is_finite() {
            self.misfit += MEMORY * (misfit - self.misfit);
        }
    }

    /// Relative variance of every pixel on top of the state's.
    pub fn of_pixels(&self, nodes: &[Node], trust: &[f32]) -> Vec<f32> {
        let views = self.since.iter().zip(&self.gained);
        let pixels = nodes.iter().zip(trust).zip(views);
        pixels
            .map(|((node, trust), (since, gained))| {
                against(*trust) + unproven(node, *since, *gained)
            })
            .collect()
    }

    /// The state's variance as it is where the noise is as measured. `square` is zeta^2.
    #[inline(always)]
    pub fn of_noise(&self, variance: f32, square: f32) -> f32 {
        let most = BY_NOISE * BY_NOISE * square;
        let by_noise = variance * most / (variance + most);
        variance - (1.0 - self.misfit.clamp(LEAST_MISFIT, 1.0)) * by_noise
    }
}

/// Relative variance of a pixel that the images speak against, however sure the planes around it are.
#[inline(always)]
fn against(trust: f32) -> f32 {
    /// Where nothing is trusted.
    const ELSEWHERE: f32 = 0.3;
    let doubt = 1.0 - 2.0 * trust;
    let doubt = ELSEWHERE * if doubt > 0.0 { doubt } else { 0.0 };
    doubt * doubt
}

/// Relative variance of a pixel that came into view lately: until its own images have shown its range, it
/// may be another surface than the one beside it. What the state has there is that one's.
#[inline(always)]
fn unproven(node: &Node, since: f32, gained: f32) -> f32 {
    let most = SLACK * since * gained;
    let own = if node[2] < most { node[2] } else { most };
    let square = node[0] * node[0];
    let variance = 1.0 / (1.0 / (OTHER * OTHER) + own * square);
    if since > 0.0 { variance } else { 0.0 }
}
