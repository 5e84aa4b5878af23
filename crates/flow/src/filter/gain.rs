//! How much brighter the new image is than a past one, measured between warped images.

use super::lattice::{LensCall, read};
use super::lens::Lens;
use super::state::Node;
use super::update::Pair;
use rayon::prelude::*;

/// Measures the gain of each row of the new image.
pub(super) struct MeasureGain<'a, 'b> {
    pub pair: &'a Pair<'b>,
    pub nodes: &'a [Node],
}

/// Sums over the pixels of a row that both images see.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    new: f64,
    past: f64,
    count: f64,
    /// Count times the median of the pair's ratios.
    median: f64,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.new += other.new;
        self.past += other.past;
        self.count += other.count;
        self.median += other.median;
    }
}

/// Every so many pixels of a row are enough.
const STEP: usize = 4;

/// Darker pixels have no ratio worth the name, grey levels.
const DARK: f32 = 4.0;

impl LensCall<Vec<f32>> for MeasureGain<'_, '_> {
    fn call<L: Lens>(self, lens: &L) -> Vec<f32> {
        let (lattice, pair, arch) = (self.pair.lattice, self.pair, pulp::Arch::new());
        let samples: Vec<Vec<[f32; 2]>> = (0..lattice.height)
            .into_par_iter()
            .map(|y| {
                arch.dispatch(RowSamples {
                    lens,
                    pair,
                    nodes: self.nodes,
                    y,
                })
            })
            .collect();
        // The median does not mind the pixels that were hidden in the past.
        let mut ratios: Vec<f32> = samples
            .iter()
            .step_by(3)
            .flatten()
            .map(|[new, past]| new / past)
            .collect();
        if ratios.len() < LEAST_SAMPLES {
            return vec![1.0; lattice.height];
        }
        let middle = ratios.len() / 2;
        let (_, median, _) = ratios.select_nth_unstable_by(middle, f32::total_cmp);
        let median = *median;
        let allowed = 4.0 * pair.new.sigma.hypot(median * pair.past.sigma);
        let sum = |row: &Vec<[f32; 2]>| {
            let mut sums = Sums::default();
            for [new, past] in row {
                if (new - median * past).abs() < allowed + ROW_CHANGE * new {
                    sums.new += f64::from(*new);
                    sums.past += f64::from(*past);
                    sums.count += 1.0;
                    sums.median += f64::from(median);
                }
            }
            sums
        };
        let sums: Vec<Sums> = samples.iter().map(sum).collect();
        gains(&sums, f64::from(pair.new.sigma))
    }
}

/// Fewer pixels measure no gain.
const LEAST_SAMPLES: usize = 50;

/// A row may be brighter or darker than the image by this share; what differs more was hidden.
const ROW_CHANGE: f32 = 0.15;

/// Brightness in both images of some pixels of a row, compiled for wide vectors.
struct RowSamples<'a, 'b, L: Lens> {
    lens: &'a L,
    pair: &'a Pair<'b>,
    nodes: &'a [Node],
    y: usize,
}

impl<L: Lens> pulp::WithSimd for RowSamples<'_, '_, L> {
    type Output = Vec<[f32; 2]>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Vec<[f32; 2]> {
        /// Samples that are worked on together.
        const TOGETHER: usize = 32;
        let (lattice, pair) = (self.pair.lattice, self.pair);
        let row = self.y * lattice.width..(self.y + 1) * lattice.width;
        let mut samples = Vec::with_capacity(lattice.width / STEP + 1);
        let mut first = row.start + self.y % STEP;
        while first < row.end {
            let count = (row.end - first).div_ceil(STEP).min(TOGETHER);
            let mut places = [[0.0_f32; 2]; TOGETHER];
            for (i, place) in places[..count].iter_mut().enumerate() {
                let here = first + i * STEP;
                let there = pair.step.rotation * lattice.ray[here]
                    + pair.step.translation * self.nodes[here][0];
                *place = self.lens.project(&there);
            }
            for (i, place) in places[..count].iter().enumerate() {
                let Some((four, s, t)) = lattice.around(*place) else {
                    continue;
                };
                let past = read(&pair.past.pixel, four, s, t)[0];
                let new = pair.new.pixel[first + i * STEP][0];
                if past > DARK && new > DARK {
                    samples.push([new, past]);
                }
            }
            first += count * STEP;
        }
        samples
    }
}

/// The new image's gain in each row: one for all, and the smoothed deviations of the rows where they are
/// more than noise (of standard deviation `sigma`).
fn gains(sums: &[Sums], sigma: f64) -> Vec<f32> {
    let height = sums.len();
    let mut total = Sums::default();
    sums.iter().for_each(|row| total.add(row));
    if total.count < LEAST_SAMPLES as f64 {
        return vec![1.0; height];
    }
    let overall = total.new / total.past;
    let level = total.past / total.count;
    // Of a mean over both images' noise.
    let variance_of = |count: f64| 2.0 * sigma * sigma / (count * level * level);
    let reach = (height / 40).max(1);
    let deviations: Vec<f64> = (0..height)
        .map(|y| {
            let mut band = Sums::default();
            let rows = y.saturating_sub(reach)..(y + reach + 1).min(height);
            sums[rows].iter().for_each(|row| band.add(row));
            if band.past > 0.0 {
                band.new / band.past / overall - 1.0
            } else {
                0.0
            }
        })
        .collect();
    let variance = deviations.iter().map(|d| d * d).sum::<f64>() / height as f64;
    let band = total.count / height as f64 * (2 * reach + 1) as f64;
    let clear = variance > 25.0 * variance_of(band) + LEAST_DEVIATION * LEAST_DEVIATION;
    // A light that does not change is not measured again and again: the noise of that would stay.
    // What is hidden moves the mean, a pattern the median: both must say so.
    let change = (overall - 1.0)
        .abs()
        .min((total.median / total.count - 1.0).abs());
    let changed = change > LEAST_CHANGE + 4.0 * variance_of(total.count).sqrt();
    let overall = if clear || changed { overall } else { 1.0 };
    let keep = if clear { 1.0 } else { 0.0 };
    let gain = |d: &f64| (overall * (1.0 + keep * d)) as f32;
    deviations.iter().map(gain).collect()
}

/// Deviations of rows below this are left to the texture that the state misplaces.
const LEAST_DEVIATION: f64 = 0.01;

/// Likewise of the whole image.
const LEAST_CHANGE: f64 = 0.002;
