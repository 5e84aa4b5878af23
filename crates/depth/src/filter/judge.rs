//! What residuals of a pair of images say of ranges, and how much.

use super::lattice::TOGETHER;
use super::pair::Pair;
use super::seen::Seen;
use super::state::Node;

/// What a pair's residuals are like.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tally {
    /// Pixels compared, and those that fit.
    pub compared: u32,
    pub fitting: u32,
    /// Information gained in every sampled row; and the same times squared residuals over those expected.
    pub information: f32,
    pub misfit: f32,
}

impl Tally {
    pub fn add(&mut self, other: &Self) {
        self.compared += other.compared;
        self.fitting += other.fitting;
        self.information += other.information;
        self.misfit += other.misfit;
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

/// Numbers that are added, or compared, side by side: one after the other they wait for each other.
const LANES: usize = 8;

/// The most that any pixel's measurement is worth by its slope, for what is known of it.
#[inline(always)]
pub(super) fn asked(new: &[[f32; 4]], nodes: &[Node]) -> f32 {
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
pub(super) struct Judge {
    gain: f32,
    told: f32,
    raw: f32,
    noise: f32,
    /// Variance of the place in the past image by the pose's error: constant, and for 1/Z squared.
    shift: [f32; 2],
    shared: f32,
    /// The most information that the pair has for a slope of one, over the share of what is known that is worth a look.
    most: f32,
}

impl Judge {
    pub fn new(pair: &Pair<'_>, y: usize, pairs: usize) -> Self {
        let gain = pair.gain[y];
        let focal2 = pair.lattice.focal_px * pair.lattice.focal_px;
        let past = pair.repeats * (gain * pair.past.sigma_raw).powi(2);
        let raw = pair.new.sigma_raw.powi(2) + past;
        let along2 = WIDE_ANGLE * focal2 * pair.step.translation.norm_squared();
        Self {
            gain,
            told: pair.told[y],
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
    pub fn matters(&self, asked: f32) -> bool {
        asked * self.most > 1.0
    }

    /// Adds what the residuals say to the nodes, each by its weight. Whether they are measured as well is known to
    /// the compiler.
    #[inline(always)]
    pub fn correct<const MEASURED: bool>(
        &self,
        seen: &Seen,
        new: &[[f32; 4]],
        nodes: &mut [Node],
        trust: &mut [f32],
    ) -> Tally {
        let mut tally = Tally::default();
        let mut misfit = [[0.0_f32; 2]; TOGETHER];
        let mut gained = [[0.0_f32; 2]; TOGETHER];
        let pixels = nodes.iter().zip(new).zip(trust);
        for (i, ((node, new), trust)) in pixels.enumerate() {
            let along = [seen.along[0][i], seen.along[1][i]];
            let reading = self.gain * self.gain * seen.past[i][3];
            let [value, gx, gy, _] = seen.past[i].map(|value| self.gain * value);
            let precision = self.told / (self.raw + reading);
            let (residual, slope) = (value - new[0], gx * along[0] + gy * along[1]);
            let known = residual.is_finite() && slope.is_finite();
            // A pose in error shifts the past image: that part of the residual is not noise.
            let shift = self.shift[0] + self.shift[1] * node[0] * node[0];
            let blurred = (gx * gx + gy * gy) * shift;
            let expected2 = self.noise + reading + blurred + slope * slope * node[3];
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
            weight *= far / (off * off * (1.0 + self.shared * blurred * precision));
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
}

/// Sums by lanes.
#[inline(always)]
fn sums(values: &[[f32; 2]; TOGETHER]) -> [f32; 2] {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// What a slope of one is worth at most, and the variance of all pixels.
    const WORTH: f32 = 0.5;
    const VARIANCE: f32 = 1e-3;

    fn judge() -> Judge {
        Judge {
            gain: 1.0,
            told: 1.0,
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
