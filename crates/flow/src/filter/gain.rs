//! How much brighter the new image is than a past one, measured between warped images.

use super::lattice::{Around, LensCall, read};
use super::lens::Lens;
use super::pair::Pair;
use super::rolling::{Sample, past_rows};
use super::state::Node;
use rayon::prelude::*;
use std::ops::Range;

/// New brightness over past brightness.
pub(super) struct Light {
    /// Of each row of the new image.
    pub gain: Vec<f32>,
    /// Of each row of the past image, besides; empty where light does not run over the rows.
    pub past: Vec<f32>,
}

/// Measures the gain of each row of both images.
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

/// Every so many rows, and columns of them, are enough.
const STEP: usize = 4;
const COLUMNS: usize = 2;

/// Darker pixels have no ratio worth the name, grey levels.
const DARK: f32 = 4.0;

impl LensCall<Light> for MeasureGain<'_, '_> {
    fn call<L: Lens>(self, lens: &L) -> Light {
        let (lattice, pair, arch) = (self.pair.lattice, self.pair, pulp::Arch::new());
        let mut samples: Vec<Vec<Sample>> = (0..lattice.height / STEP)
            .into_par_iter()
            .map(|row| {
                arch.dispatch(RowSamples {
                    lens,
                    pair,
                    nodes: self.nodes,
                    y: row * STEP + STEP / 2,
                })
            })
            .collect();
        let (gain, clear) = self.gains(&samples);
        if !clear {
            return Light {
                gain,
                past: Vec::new(),
            };
        }
        let past = past_rows(&samples.concat(), &gain, lattice.height);
        for sample in samples.iter_mut().flatten() {
            let gain = past.get(sample.past_row.round() as usize);
            sample.past *= gain.copied().unwrap_or(1.0);
        }
        Light {
            gain: self.gains(&samples).0,
            past,
        }
    }
}

impl MeasureGain<'_, '_> {
    /// The gain of each row of the new image, and whether rows differ clearly.
    fn gains(&self, samples: &[Vec<Sample>]) -> (Vec<f32>, bool) {
        let (pair, height) = (self.pair, self.pair.lattice.height);
        // The median does not mind the pixels that were hidden in the past.
        let mut ratios: Vec<f32> = samples
            .iter()
            .step_by(3)
            .flatten()
            .map(|sample| sample.new / sample.past)
            .collect();
        if ratios.len() < LEAST_SAMPLES {
            return (vec![1.0; height], false);
        }
        let middle = ratios.len() / 2;
        let (_, median, _) = ratios.select_nth_unstable_by(middle, f32::total_cmp);
        let median = *median;
        let allowed = 4.0 * pair.new.sigma.hypot(median * pair.past.sigma);
        let sum = |row: &Vec<Sample>| {
            let mut sums = Sums::default();
            for Sample { new, past, .. } in row {
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
        gains(&sums, f64::from(pair.new.sigma), height)
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
    type Output = Vec<Sample>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Vec<Sample> {
        let width = self.pair.lattice.width;
        let mut samples = Vec::with_capacity(width.div_ceil(COLUMNS));
        let row = self.y * width..(self.y + 1) * width;
        for first in row.clone().step_by(TOGETHER * COLUMNS) {
            self.block(first..row.end.min(first + TOGETHER * COLUMNS), &mut samples);
        }
        samples
    }
}

/// Samples that are worked on together.
const TOGETHER: usize = 64;

impl<L: Lens> RowSamples<'_, '_, L> {
    #[inline(always)]
    fn block(&self, pixels: Range<usize>, samples: &mut Vec<Sample>) {
        let (pair, lattice) = (self.pair, self.pair.lattice);
        let mut places = [[f32::NAN; TOGETHER]; 2];
        let rays = lattice.ray[pixels.clone()].chunks(COLUMNS);
        let nodes = self.nodes[pixels.clone()].chunks(COLUMNS);
        for (i, (ray, node)) in rays.zip(nodes).enumerate() {
            let (ray, node) = (&ray[0], &node[0]);
            let there = pair.step.rotation * ray + pair.step.translation * node[0];
            [places[0][i], places[1][i]] = self.lens.project(&there);
        }
        let mut around = Around::new();
        lattice.around_each(&places, &mut around);
        for (i, new) in pair.new.pixel[pixels].chunks(COLUMNS).enumerate() {
            let [new, ..] = new[0];
            let four = around.four(lattice.width, i);
            let past = read(&pair.past.pixel, four, around.across[i], around.down[i])[0];
            if past > DARK && new > DARK {
                samples.push(Sample {
                    new,
                    past,
                    row: self.y as f32,
                    past_row: places[1][i],
                });
            }
        }
    }
}

/// The new image's gain in each of `height` rows: one for all, and the smoothed deviations of the rows where
/// they are more than noise (of standard deviation `sigma`). The sums are those of every so many rows.
fn gains(sums: &[Sums], sigma: f64, height: usize) -> (Vec<f32>, bool) {
    let rows = sums.len();
    let mut total = Sums::default();
    sums.iter().for_each(|row| total.add(row));
    if total.count < LEAST_SAMPLES as f64 {
        return (vec![1.0; height], false);
    }
    let overall = total.new / total.past;
    let level = total.past / total.count;
    // Of a mean over both images' noise.
    let variance_of = |count: f64| 2.0 * sigma * sigma / (count * level * level);
    let reach = (height / 40 / STEP).max(1);
    let deviations: Vec<f64> = (0..rows)
        .map(|y| {
            let mut band = Sums::default();
            // As far up as down: a mean of one side would be another row's.
            let reach = reach.min(y).min(rows - 1 - y);
            sums[y - reach..=y + reach]
                .iter()
                .for_each(|row| band.add(row));
            if band.past > 0.0 {
                band.new / band.past / overall - 1.0
            } else {
                0.0
            }
        })
        .collect();
    let variance = deviations.iter().map(|d| d * d).sum::<f64>() / rows as f64;
    let band = total.count / rows as f64 * (2 * reach + 1) as f64;
    let clear = variance > 25.0 * variance_of(band) + LEAST_DEVIATION * LEAST_DEVIATION;
    // A light that does not change is not measured again and again: the noise of that would stay.
    // What is hidden moves the mean, a pattern the median: both must say so.
    let change = (overall - 1.0)
        .abs()
        .min((total.median / total.count - 1.0).abs());
    let changed = change > LEAST_CHANGE + 4.0 * variance_of(total.count).sqrt();
    let overall = if clear || changed { overall } else { 1.0 };
    let keep = if clear { 1.0 } else { 0.0 };
    let gain = |y| (overall * (1.0 + keep * between(&deviations, y))) as f32;
    ((0..height).map(gain).collect(), clear)
}

/// The line through the measured rows around a row.
fn between(rows: &[f64], y: usize) -> f64 {
    let place = (y as f64 - (STEP / 2) as f64) / STEP as f64;
    let low = (place.max(0.0) as usize).min(rows.len() - 2);
    rows[low] + (place - low as f64) * (rows[low + 1] - rows[low])
}

/// Deviations of rows below this are left to the texture that the state misplaces.
const LEAST_DEVIATION: f64 = 0.01;

/// Likewise of the whole image.
const LEAST_CHANGE: f64 = 0.002;
