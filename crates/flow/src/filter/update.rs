//! The state corrected by comparing the new image with one of the past.

use super::lattice::{Lattice, LensCall, read};
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

/// Pixels that share an error of the pose: averaging does not lower it.
const SHARED: f32 = 100.0;

/// A past surface nearer by this share hides the pixel.
pub(super) const HIDES: f32 = 1.06;

impl LensCall<(usize, usize)> for Update<'_, '_> {
    fn call<L: Lens>(self, lens: &L) -> (usize, usize) {
        let Self { pair, nodes, trust } = self;
        let (width, arch) = (pair.lattice.width, pulp::Arch::new());
        let counts: Vec<(usize, usize)> = nodes
            .par_chunks_mut(width)
            .zip(trust.par_chunks_mut(width))
            .enumerate()
            .map(|(y, (row, trust))| {
                arch.dispatch(UpdateRow {
                    lens,
                    pair,
                    y,
                    row,
                    trust,
                })
            })
            .collect();
        counts.iter().fold((0, 0), |(a, b), (c, d)| (a + c, b + d))
    }
}

/// Pixels that are worked on together: their numbers stay in registers and the first cache.
const TOGETHER: usize = 64;

/// One row, compiled for wide vectors. Returns the pixels compared and those that fit.
struct UpdateRow<'a, 'b, L: Lens> {
    lens: &'a L,
    pair: &'a Pair<'b>,
    y: usize,
    row: &'a mut [Node],
    trust: &'a mut [f32],
}

impl<L: Lens> pulp::WithSimd for UpdateRow<'_, '_, L> {
    type Output = (usize, usize);

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> (usize, usize) {
        let (mut compared, mut fitting) = (0, 0);
        let mut first = self.y * self.pair.lattice.width;
        let judge = Judge::new(self.pair, self.y);
        let nodes = self.row.chunks_mut(TOGETHER);
        for (nodes, trust) in nodes.zip(self.trust.chunks_mut(TOGETHER)) {
            let mut seen = Seen::new();
            seen.place(self.lens, self.pair, first, nodes);
            seen.read(self.pair, first, nodes);
            let counts = seen.judge(&judge, nodes, trust);
            (compared, fitting) = (compared + counts.0, fitting + counts.1);
            first += nodes.len();
        }
        (compared as usize, fitting as usize)
    }
}

/// What a row's residuals are judged by.
struct Judge {
    raw: f32,
    noise: f32,
    /// Variance of the place in the past image by the pose's error: constant, and for 1/Z squared.
    shift: [f32; 2],
    shared: f32,
}

impl Judge {
    fn new(pair: &Pair<'_>, y: usize) -> Self {
        let gain = pair.gain[y];
        let focal2 = pair.lattice.focal_px * pair.lattice.focal_px;
        Self {
            raw: pair.new.sigma_raw.powi(2) + (gain * pair.past.sigma_raw).powi(2),
            noise: pair.new.sigma.powi(2) + (gain * pair.past.sigma).powi(2),
            shift: [
                pair.drift.rotation * focal2,
                pair.drift.translation * focal2,
            ],
            shared: SHARED,
        }
    }
}

/// Pixels of a row in the past image: places, their derivative by zeta, and what is there.
struct Seen {
    place: [[f32; TOGETHER]; 2],
    along: [[f32; TOGETHER]; 2],
    gauge: [f32; TOGETHER],
    residual: [f32; TOGETHER],
    /// Variance of reading the past image there.
    read: [f32; TOGETHER],
    slope: [[f32; TOGETHER]; 2],
}

impl Seen {
    #[inline(always)]
    fn new() -> Self {
        Self {
            place: [[0.0; TOGETHER]; 2],
            along: [[0.0; TOGETHER]; 2],
            gauge: [0.0; TOGETHER],
            residual: [f32::NAN; TOGETHER],
            read: [0.0; TOGETHER],
            slope: [[0.0; TOGETHER]; 2],
        }
    }

    #[inline(always)]
    fn place<L: Lens>(&mut self, lens: &L, pair: &Pair<'_>, first: usize, nodes: &[Node]) {
        let (turn, step) = (&pair.step.rotation, &pair.step.translation);
        let rays = &pair.lattice.ray[first..first + nodes.len()];
        for (i, (node, ray)) in nodes.iter().zip(rays).enumerate() {
            let there = turn * ray + step * node[0];
            let (place, along) = lens.project_along(&there, step);
            (self.place[0][i], self.place[1][i]) = (place[0], place[1]);
            (self.along[0][i], self.along[1][i]) = (along[0], along[1]);
            self.gauge[i] = lens.gauge(&there);
        }
    }

    /// Residuals stay NaN where the past image does not show the pixel.
    #[inline(always)]
    fn read(&mut self, pair: &Pair<'_>, first: usize, nodes: &[Node]) {
        let past = &pair.past.pixel;
        let gain = pair.gain[first / pair.lattice.width];
        for (i, node) in nodes.iter().enumerate() {
            let place = [self.place[0][i], self.place[1][i]];
            let Some((four, s, t)) = pair.lattice.around(place) else {
                continue;
            };
            if !pair.surface.is_empty() {
                let nearest = four[usize::from(s > 0.5) + 2 * usize::from(t > 0.5)];
                if pair.surface[nearest] * self.gauge[i] > HIDES * node[0] {
                    continue;
                }
            }
            let [value, gx, gy, variance] = read(past, four, s, t);
            self.residual[i] = gain * value - pair.new.pixel[first + i][0];
            self.read[i] = gain * gain * variance;
            (self.slope[0][i], self.slope[1][i]) = (gain * gx, gain * gy);
        }
    }

    /// Adds what the residuals say to the nodes, each by its weight.
    #[inline(always)]
    fn judge(&self, judge: &Judge, nodes: &mut [Node], trust: &mut [f32]) -> (u32, u32) {
        let (mut compared, mut fitting) = (0, 0);
        let mut gained = [[0.0_f32; 2]; TOGETHER];
        for (i, (node, trust)) in nodes.iter().zip(trust).enumerate() {
            let along = [self.along[0][i], self.along[1][i]];
            let (gx, gy) = (self.slope[0][i], self.slope[1][i]);
            let (residual, slope) = (self.residual[i], gx * along[0] + gy * along[1]);
            let known = residual.is_finite() && slope.is_finite();
            // A pose in error shifts the past image: that part of the residual is not noise.
            let shift = judge.shift[0] + judge.shift[1] * node[0] * node[0];
            let blurred = (gx * gx + gy * gy) * shift;
            let precision = 1.0 / (judge.raw + self.read[i]);
            let expected2 = judge.noise + self.read[i] + blurred + slope * slope * node[3];
            let size2 = residual * residual;
            let reach2 = HUBER * HUBER * expected2;
            let fits = if size2 > reach2 { reach2 / size2 } else { 1.0 };
            let mut weight = fits.sqrt() * *trust;
            // Where the state may be off by pixels, a long baseline meets the wrong piece of texture.
            let span2 = along[0] * along[0] + along[1] * along[1];
            let off = 1.0 + node[3] * span2 * (1.0 / (LARGEST_DOUBT_PX * LARGEST_DOUBT_PX));
            let moved2 = size2 * span2;
            let most2 = LARGEST_MOVE_PX * LARGEST_MOVE_PX * slope * slope;
            let far = if moved2 > most2 { most2 / moved2 } else { 1.0 };
            weight *= far / (off * off * (1.0 + judge.shared * blurred * precision));
            let information = if known { weight * precision } else { 0.0 };
            gained[i] = if known {
                [information * slope * residual, information * slope * slope]
            } else {
                [0.0; 2]
            };
            *trust *= if known { fits } else { 1.0 };
            compared += u32::from(known);
            fitting += u32::from(known && fits == 1.0);
        }
        for (node, gained) in nodes.iter_mut().zip(&gained) {
            node[1] -= gained[0];
            node[2] += gained[1];
        }
        (compared, fitting)
    }
}
