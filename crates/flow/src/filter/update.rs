//! The state corrected by comparing the new image with one of the past.

use super::doubt::Views;
use super::lattice::{Around, Lattice, LensCall, read};
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

/// The correction of the nodes by a pair.
pub(super) struct Update<'a, 'b> {
    pub pair: &'a Pair<'b>,
    pub nodes: &'a mut [Node],
    /// How well shorter baselines fit, 0 to 1: where they do not, a longer one meets the wrong
    /// piece of texture, and would drown them by its weight.
    pub trust: &'a mut [f32],
    /// What the pairs before say of each pixel's time in view.
    pub views: Views<'a>,
    /// Frames to the past image.
    pub lag: usize,
    /// Whether no pair was before.
    pub begins: bool,
}

/// What a pair's residuals are like.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tally {
    /// Pixels compared, and those that fit.
    pub compared: u32,
    pub fitting: u32,
    /// Information gained in every [`SAMPLED`]th row; and the same times squared residuals over those expected.
    pub information: f32,
    pub misfit: f32,
}

/// Rows from one whose residuals are compared with those expected to the next: a quarter says as much of the image.
const SAMPLED: usize = 4;

/// Information fades where the shortest baselines do not fit: to this share where nothing is trusted.
const FADE: f32 = 0.85;

/// Old mistakes are forgotten where the images speak against them. The mean stays. Where `views` holds the
/// information of before the image, it is what the image gave afterwards.
pub(super) fn fade(nodes: &mut [Node], trust: &[f32], views: Views<'_>) {
    for ((node, trust), gained) in nodes.iter_mut().zip(trust).zip(views.gained) {
        *gained = node[2] - *gained;
        let keep = FADE + (1.0 - FADE) * (2.0 * trust).min(1.0);
        node[1] *= keep;
        node[2] *= keep;
    }
}

/// Where Huber's weight begins to fall, in standard deviations of the predicted residual.
const HUBER: f32 = 2.5;

/// A correction by more than this many pixels of the past image says little.
const LARGEST_MOVE_PX: f32 = 4.0;

/// Uncertainty of the place in the past image beyond which a pair says little, pixels.
const LARGEST_DOUBT_PX: f32 = 4.0;

/// Pixels that share an error of the pose: averaging does not lower it.
const SHARED: f32 = 100.0;

/// Share of what is known of a pixel, by itself and the planes around it, below which what a pair adds does not matter:
/// over the filter's memory it sums to some percent.
const LITTLE: f32 = 1e-4;

/// Squared parallax off the middle of the image over that in it, at most.
const WIDE_ANGLE: f32 = 2.0;

/// A past surface nearer by this share hides the pixel.
pub(super) const HIDES: f32 = 1.06;

impl LensCall<Tally> for Update<'_, '_> {
    fn call<L: Lens>(self, lens: &L) -> Tally {
        let Self {
            pair,
            nodes,
            trust,
            views,
            lag,
            begins,
        } = self;
        let (width, arch) = (pair.lattice.width, pulp::Arch::new());
        let rows: Vec<Tally> = nodes
            .par_chunks_mut(width)
            .zip(trust.par_chunks_mut(width))
            .zip(views.since.par_chunks_mut(width))
            .zip(views.gained.par_chunks_mut(width))
            .enumerate()
            .map(|(y, (((row, trust), since), gained))| {
                arch.dispatch(UpdateRow {
                    lens,
                    pair,
                    y,
                    row,
                    trust,
                    views: Views { since, gained },
                    lag: lag as f32,
                    begins,
                })
            })
            .collect();
        let mut all = Tally::default();
        rows.iter().for_each(|row| all.add(row));
        all
    }
}

/// Pixels that are worked on together: their numbers stay in registers and the first cache.
const TOGETHER: usize = 64;

/// One row, compiled for wide vectors.
struct UpdateRow<'a, 'b, L: Lens> {
    lens: &'a L,
    pair: &'a Pair<'b>,
    y: usize,
    row: &'a mut [Node],
    trust: &'a mut [f32],
    views: Views<'a>,
    lag: f32,
    begins: bool,
}

impl<L: Lens> pulp::WithSimd for UpdateRow<'_, '_, L> {
    type Output = Tally;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Tally {
        let mut tally = Tally::default();
        let mut first = self.y * self.pair.lattice.width;
        let judge = Judge::new(self.pair, self.y);
        if self.begins {
            let before = self.views.gained.iter_mut().zip(&*self.row);
            before.for_each(|(gained, node)| *gained = node[2]);
        }
        let mut seen = Seen::new();
        let pixels = self.row.chunks_mut(TOGETHER);
        let pixels = pixels.zip(self.trust.chunks_mut(TOGETHER));
        for ((nodes, trust), since) in pixels.zip(self.views.since.chunks_mut(TOGETHER)) {
            let new = &self.pair.new.pixel[first..first + nodes.len()];
            if !judge.matters(new, nodes) {
                first += nodes.len();
                continue;
            }
            seen.place(self.lens, self.pair, first, nodes);
            seen.read(self.pair, nodes);
            tally.add(&match self.y % SAMPLED {
                0 => seen.judge::<true>(&judge, new, nodes, trust),
                _ => seen.judge::<false>(&judge, new, nodes, trust),
            });
            if !self.pair.lattice.wraps {
                seen.date(self.pair, self.lag, since);
            }
            first += nodes.len();
        }
        tally
    }
}

/// What a row's residuals are judged by.
struct Judge {
    gain: f32,
    raw: f32,
    noise: f32,
    /// Variance of the place in the past image by the pose's error: constant, and for 1/Z squared.
    shift: [f32; 2],
    shared: f32,
    /// The most information that the pair has for a slope of one, over the share of what is known that is worth a look.
    most: f32,
}

impl Judge {
    fn new(pair: &Pair<'_>, y: usize) -> Self {
        let gain = pair.gain[y];
        let focal2 = pair.lattice.focal_px * pair.lattice.focal_px;
        let raw = pair.new.sigma_raw.powi(2) + (gain * pair.past.sigma_raw).powi(2);
        let along2 = WIDE_ANGLE * focal2 * pair.step.translation.norm_squared();
        Self {
            gain,
            raw,
            noise: pair.new.sigma.powi(2) + (gain * pair.past.sigma).powi(2),
            shift: [
                pair.drift.rotation * focal2,
                pair.drift.translation * focal2,
            ],
            shared: SHARED,
            most: along2 / (LITTLE * raw),
        }
    }

    /// Whether the pair may add more than next to nothing to what any of the pixels has.
    #[inline(always)]
    fn matters(&self, new: &[[f32; 4]], nodes: &[Node]) -> bool {
        let mut matters = false;
        for (node, [_, gx, gy, _]) in nodes.iter().zip(new) {
            matters |= (gx * gx + gy * gy) * self.most * node[3] > 1.0;
        }
        matters
    }
}

/// Pixels of a row in the past image: places, their derivative by zeta, and what is there.
struct Seen {
    place: [[f32; TOGETHER]; 2],
    along: [[f32; TOGETHER]; 2],
    gauge: [f32; TOGETHER],
    around: Around<TOGETHER>,
    /// Brightness, slopes and variance of reading in the past image; NaN where it does not show the pixel.
    past: [[f32; 4]; TOGETHER],
}

impl Seen {
    #[inline(always)]
    fn new() -> Self {
        Self {
            place: [[0.0; TOGETHER]; 2],
            along: [[0.0; TOGETHER]; 2],
            gauge: [0.0; TOGETHER],
            around: Around::new(),
            past: [[f32::NAN; 4]; TOGETHER],
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

    #[inline(always)]
    fn read(&mut self, pair: &Pair<'_>, nodes: &[Node]) {
        let width = pair.lattice.width;
        pair.lattice.around_each(&self.place, &mut self.around);
        if !pair.surface.is_empty() {
            for (i, node) in nodes.iter().enumerate() {
                let nearest = pair.surface[self.around.nearest[i] as usize];
                let hidden = nearest * self.gauge[i] > HIDES * node[0];
                self.around.across[i] = if hidden {
                    f32::NAN
                } else {
                    self.around.across[i]
                };
            }
        }
        for i in 0..nodes.len() {
            let (s, t) = (self.around.across[i], self.around.down[i]);
            self.past[i] = read(&pair.past.pixel, self.around.four(width, i), s, t);
        }
    }

    /// Adds what the residuals say to the nodes, each by its weight. Whether they are measured as well is known to
    /// the compiler.
    #[inline(always)]
    fn judge<const MEASURED: bool>(
        &self,
        judge: &Judge,
        new: &[[f32; 4]],
        nodes: &mut [Node],
        trust: &mut [f32],
    ) -> Tally {
        let mut tally = Tally::default();
        let mut misfit = [[0.0_f32; 2]; TOGETHER];
        let mut gained = [[0.0_f32; 2]; TOGETHER];
        let pixels = nodes.iter().zip(new).zip(trust);
        for (i, ((node, new), trust)) in pixels.enumerate() {
            let along = [self.along[0][i], self.along[1][i]];
            let reading = judge.gain * judge.gain * self.past[i][3];
            let [value, gx, gy, _] = self.past[i].map(|value| judge.gain * value);
            let precision = 1.0 / (judge.raw + reading);
            let (residual, slope) = (value - new[0], gx * along[0] + gy * along[1]);
            let known = residual.is_finite() && slope.is_finite();
            // A pose in error shifts the past image: that part of the residual is not noise.
            let shift = judge.shift[0] + judge.shift[1] * node[0] * node[0];
            let blurred = (gx * gx + gy * gy) * shift;
            let expected2 = judge.noise + reading + blurred + slope * slope * node[3];
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
            if MEASURED {
                // Outliers, which weigh less, say nothing of the noise.
                let square = if size2 > reach2 { reach2 } else { size2 };
                let relative = gained[i][1] * square / expected2;
                misfit[i] = [gained[i][1], if known { relative } else { 0.0 }];
            }
            *trust *= if known { fits } else { 1.0 };
            tally.compared += u32::from(known);
            tally.fitting += u32::from(known && fits == 1.0);
        }
        for (node, gained) in nodes.iter_mut().zip(&gained) {
            node[1] -= gained[0];
            node[2] += gained[1];
        }
        if MEASURED {
            [tally.information, tally.misfit] = sums(&misfit);
        }
        tally
    }

    /// Notes the least lag at which pixels were out of view.
    #[inline(always)]
    fn date(&self, pair: &Pair<'_>, lag: f32, since: &mut [f32]) {
        let lattice = pair.lattice;
        // What is carried is read between pixels.
        let margin = pair.past.margin + 1.0;
        let right = (lattice.width - 1) as f32 - margin;
        let bottom = (lattice.height - 1) as f32 - margin;
        let shown = |i: usize| {
            let (x, y) = (self.place[0][i], self.place[1][i]);
            (x >= margin) & (x <= right) & (y >= margin) & (y <= bottom)
        };
        // Most blocks are wholly inside.
        let all = (0..since.len()).fold(true, |all, i| all & shown(i));
        if all {
            return;
        }
        for (i, since) in since.iter_mut().enumerate() {
            let shown = shown(i) | (*since > 0.0);
            *since = if shown { *since } else { lag };
        }
    }
}

/// Sums by lanes: one after the other, numbers wait for each other.
#[inline(always)]
fn sums(values: &[[f32; 2]; TOGETHER]) -> [f32; 2] {
    const LANES: usize = 8;
    let mut lanes = [[0.0_f32; 2]; LANES];
    for values in values.chunks_exact(LANES) {
        for (lane, value) in lanes.iter_mut().zip(values) {
            *lane = [lane[0] + value[0], lane[1] + value[1]];
        }
    }
    lanes
        .iter()
        .fold([0.0; 2], |sum, lane| [sum[0] + lane[0], sum[1] + lane[1]])
}

impl Tally {
    pub fn add(&mut self, other: &Self) {
        self.compared += other.compared;
        self.fitting += other.fitting;
        self.information += other.information;
        self.misfit += other.misfit;
    }
}
