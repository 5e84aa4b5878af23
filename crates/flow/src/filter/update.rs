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
    /// Frames to the past image.
    pub lag: usize,
}

/// The correction of the nodes by an image's pairs, the shortest first.
pub(super) struct Update<'a, 'b> {
    pub pairs: &'a [Pair<'b>],
    pub nodes: &'a mut [Node],
    /// How well baselines fit, 0 to 1: where short ones do not, a longer one meets the wrong
    /// piece of texture, and would drown them by its weight.
    pub trust: &'a mut [f32],
    /// What the pairs say of each pixel's time in view.
    pub views: Views<'a>,
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

/// Pixels that share an error of the pose, for each of the pairs that share it too: averaging does not lower it.
const SHARED: f32 = 25.0;

/// Share of what is known of a pixel, by itself and the planes around it, below which what a pair adds does not matter:
/// over the filter's memory it sums to some percent.
const LITTLE: f32 = 2e-4;

/// Squared parallax off the middle of the image over that in it, at most.
const WIDE_ANGLE: f32 = 2.0;

/// A past surface nearer by this share hides the pixel.
pub(super) const HIDES: f32 = 1.06;

impl LensCall<Tally> for Update<'_, '_> {
    fn call<L: Lens>(self, lens: &L) -> Tally {
        let Self {
            pairs,
            nodes,
            trust,
            views,
        } = self;
        trust.fill(1.0);
        let Some(first) = pairs.first() else {
            return Tally::default();
        };
        let (width, arch) = (first.lattice.width, pulp::Arch::new());
        let rows: Vec<Tally> = nodes
            .par_chunks_mut(width)
            .zip(trust.par_chunks_mut(width))
            .zip(views.since.par_chunks_mut(width))
            .zip(views.gained.par_chunks_mut(width))
            .enumerate()
            .map(|(y, (((row, trust), since), gained))| {
                arch.dispatch(UpdateRow {
                    lens,
                    new: first.new,
                    pairs,
                    y,
                    row,
                    trust,
                    views: Views { since, gained },
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
    /// The image of all pairs.
    new: &'a Prepared,
    pairs: &'a [Pair<'b>],
    y: usize,
    row: &'a mut [Node],
    trust: &'a mut [f32],
    views: Views<'a>,
}

impl<L: Lens> pulp::WithSimd for UpdateRow<'_, '_, L> {
    type Output = Tally;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Tally {
        let mut tally = Tally::default();
        let mut first = self.y * self.row.len();
        let before = self.views.gained.iter_mut().zip(&*self.row);
        before.for_each(|(gained, node)| *gained = node[2]);
        let mut seen = Seen::new();
        let pixels = self.row.chunks_mut(TOGETHER);
        let pixels = pixels.zip(self.trust.chunks_mut(TOGETHER));
        for ((nodes, trust), since) in pixels.zip(self.views.since.chunks_mut(TOGETHER)) {
            let new = &self.new.pixel[first..][..nodes.len()];
            let asked = asked(new, nodes);
            for pair in self.pairs {
                let judge = Judge::new(pair, self.y, self.pairs.len());
                if !judge.matters(asked) {
                    continue;
                }
                seen.place(self.lens, pair, first, nodes);
                seen.read(pair, nodes);
                tally.add(&match self.y % SAMPLED {
                    0 => seen.judge::<true>(&judge, new, nodes, trust),
                    _ => seen.judge::<false>(&judge, new, nodes, trust),
                });
                if !pair.lattice.wraps {
                    seen.date(pair, since);
                }
            }
            first += nodes.len();
        }
        tally
    }
}

/// The most that any pixel's measurement is worth by its slope, for what is known of it.
#[inline(always)]
fn asked(new: &[[f32; 4]], nodes: &[Node]) -> f32 {
    const LANES: usize = 8;
    let mut lanes = [0.0_f32; LANES];
    let blocks = nodes.chunks(LANES).zip(new.chunks(LANES));
    for (nodes, new) in blocks {
        for ((most, node), [_, gx, gy, _]) in lanes.iter_mut().zip(nodes).zip(new) {
            let here = (gx * gx + gy * gy) * node[3];
            *most = if here > *most { here } else { *most };
        }
    }
    lanes.into_iter().fold(0.0, f32::max)
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
    fn new(pair: &Pair<'_>, y: usize, pairs: usize) -> Self {
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
            shared: SHARED * pairs as f32,
            most: along2 / (LITTLE * raw),
        }
    }

    /// Whether the pair may add more than next to nothing to what any of the pixels has that are worth so much.
    #[inline(always)]
    fn matters(&self, asked: f32) -> bool {
        asked * self.most > 1.0
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
    fn date(&self, pair: &Pair<'_>, since: &mut [f32]) {
        let lag = pair.lag as f32;
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

#[cfg(test)]
mod tests {
    use super::*;

    /// What a slope of one is worth at most, and the variance of all pixels.
    const WORTH: f32 = 0.5;
    const VARIANCE: f32 = 1e-3;

    fn judge() -> Judge {
        Judge {
            gain: 1.0,
            raw: 4.0,
            noise: 4.0,
            shift: [0.0; 2],
            shared: 0.0,
            most: WORTH / LITTLE,
        }
    }

    #[test]
    fn a_pair_is_left_out_only_where_it_adds_little_to_every_pixel() {
        // The slope by which a pixel would gain just so much of what is known of it.
        let just = (LITTLE / (WORTH * VARIANCE)).sqrt();
        let nodes = [[0.5, 0.0, 1e3, VARIANCE]; TOGETHER];
        let mut new = [[7.0, 0.6 * just, -0.7 * just, 0.0]; TOGETHER];
        new[3][1] = f32::NAN;
        for count in [TOGETHER, 5] {
            let asked = asked(&new[..count], &nodes[..count]);
            assert!(!judge().matters(asked), "{count} pixels");
        }
        // Whichever pixel it is, also in the part of a row that is left over.
        for (pixel, count) in [(0, TOGETHER), (63, TOGETHER), (8, 9)] {
            let mut new = new;
            new[pixel][2] = -1.1 * just;
            let asked = asked(&new[..count], &nodes[..count]);
            assert!(judge().matters(asked), "pixel {pixel} of {count}");
        }
    }
}
