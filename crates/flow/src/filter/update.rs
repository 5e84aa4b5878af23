//! The state corrected by comparing the new image with one of the past.

use super::lattice::{Lattice, LensCall, mix};
use super::lens::Lens;
use super::predict::Step;
use super::prepare::Prepared;
use super::state::{Drift, Node};
use rayon::prelude::*;

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
    /// Uncertainty of the step.
    pub drift: Drift,
}

/// The correction of the nodes by a pair. Returns the number of pixels compared and of those that fit.
pub(super) struct Update<'a, 'b> {
    pub pair: &'a Pair<'b>,
    pub nodes: &'a mut [Node],
    /// How well shorter baselines fit, 0 to 1: where they do not, a longer one meets the wrong
    /// piece of texture, and would drown them by its weight.
    pub trust: &'a mut [f32],
}

/// Information fades where the shortest baselines do not fit: to this share where nothing is trusted.
const FADE: f32 = 0.85;

/// Old mistakes are forgotten where the images speak against them. The mean stays.
pub(super) fn fade(nodes: &mut [Node], trust: &[f32]) {
    for (node, trust) in nodes.iter_mut().zip(trust) {
        let keep = FADE + (1.0 - FADE) * (2.0 * trust).min(1.0);
        node[1] *= keep;
        node[2] *= keep;
    }
}

/// Where Huber's weight begins to fall, in standard deviations of the predicted residual.
const HUBER: f32 = 3.0;

/// A correction by more than this many pixels of the past image says little.
const LARGEST_MOVE_PX: f32 = 4.0;

/// Uncertainty of the place in the past image beyond which a pair says little, pixels.
const LARGEST_DOUBT_PX: f32 = 4.0;

/// A past surface nearer by this share hides the pixel.
const HIDES: f32 = 1.06;

impl LensCall<(usize, usize)> for Update<'_, '_> {
    fn call<L: Lens>(self, lens: &L) -> (usize, usize) {
        let Self { pair, nodes, trust } = self;
        let width = pair.lattice.width;
        let counts: Vec<(usize, usize)> = nodes
            .par_chunks_mut(width)
            .zip(trust.par_chunks_mut(width))
            .enumerate()
            .map(|(y, (row, trust))| update_row(lens, pair, y, row, trust))
            .collect();
        counts.iter().fold((0, 0), |(a, b), (c, d)| (a + c, b + d))
    }
}

fn update_row<L: Lens>(
    lens: &L,
    pair: &Pair<'_>,
    y: usize,
    row: &mut [Node],
    trust: &mut [f32],
) -> (usize, usize) {
    let lattice = pair.lattice;
    let (new, past) = (&pair.new.pixel, &pair.past.pixel);
    let gain = pair.gain[y];
    let raw = pair.new.sigma_raw.powi(2) + (gain * pair.past.sigma_raw).powi(2);
    let noise = pair.new.sigma.powi(2) + (gain * pair.past.sigma).powi(2);
    // Both kinds of noise are one where only the scale of the information matters.
    let precision = 1.0 / raw;
    let (mut compared, mut fitting) = (0, 0);
    let start = y * lattice.width;
    for (x, (node, trust)) in row.iter_mut().zip(trust).enumerate() {
        let here = start + x;
        let there = pair.step.rotation * lattice.ray[here] + pair.step.translation * node[0];
        let (place, along) = lens.project_along(&there, &pair.step.translation);
        let Some((four, s, t)) = lattice.around(place) else {
            continue;
        };
        if !pair.surface.is_empty() {
            let nearest = four[usize::from(s > 0.5) + 2 * usize::from(t > 0.5)];
            if pair.surface[nearest] > HIDES * node[0] / lens.gauge(&there) {
                continue;
            }
        }
        let [value, gx, gy, _] = mix(past, four, s, t);
        let residual = gain * value - new[here][0];
        let slope = gain * (gx * along[0] + gy * along[1]);
        if !(residual.is_finite() && slope.is_finite()) {
            continue;
        }
        // A pose in error shifts the past image: that part of the residual is not noise.
        let shift = pair.drift.rotation * lattice.focal_px * lattice.focal_px
            + pair.drift.translation * (lattice.focal_px * node[0]).powi(2);
        let blurred = gain * gain * (gx * gx + gy * gy) * shift;
        let expected = (noise + blurred + slope * slope * node[3]).sqrt();
        let size = residual.abs();
        let mut weight = (HUBER * expected / size.max(1e-6)).min(1.0);
        compared += 1;
        fitting += usize::from(weight == 1.0);
        let fits = weight * weight;
        weight *= *trust;
        *trust *= fits;
        // Where the state may be off by pixels, a long baseline meets the wrong piece of texture.
        let span = along[0] * along[0] + along[1] * along[1];
        let off = 1.0 + node[3] * span / (LARGEST_DOUBT_PX * LARGEST_DOUBT_PX);
        weight /= off * off;
        let moved = size * span.sqrt();
        let reach = LARGEST_MOVE_PX * slope.abs();
        if moved > reach {
            weight *= (reach / moved).powi(2);
        }
        let information = weight * precision * raw / (raw + blurred);
        node[1] -= information * slope * residual;
        node[2] += information * slope * slope;
    }
    (compared, fitting)
}
