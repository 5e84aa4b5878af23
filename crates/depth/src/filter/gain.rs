//! How much brighter the new image is than a past one, measured between warped images.
//!
//! Where ranges or poses are off, rows look brighter or darker as well: what an error explains that the ranges of a
//! row's pixels have in common, or their places, within their deviation, is not taken for light.

use super::lattice::{Around, LensCall, TOGETHER, read};
use super::lens::Lens;
use super::pair::Pair;
use super::rolling::{Sample, past_rows};
use super::row_light::RowLight;
use super::state::Node;
use rayon::prelude::*;
use sphereflow_core::statistics::median_mut;
use std::ops::Range;

/// New brightness over past brightness.
pub(super) struct Light {
    /// Of each row of the new image.
    pub gain: Vec<f32>,
    /// Of each row of the past image, besides; empty where light does not run over the rows.
    pub past: Vec<f32>,
    /// Share of what each row of the new image says of its ranges that light could not explain as well.
    pub told: Vec<f32>,
}

/// Measures the gain of each row of both images.
pub(super) struct MeasureGain<'a, 'b> {
    pub pair: &'a Pair<'b>,
    pub nodes: &'a [Node],
}

/// Brightness, summed over the pixels that both images see.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    new: f64,
    past: f64,
    count: f64,
}

impl Sums {
    fn add(&mut self, sample: &Sample) {
        self.new += f64::from(sample.new);
        self.past += f64::from(sample.past);
        self.count += 1.0;
    }

    fn gain(&self) -> f64 {
        self.new / self.past
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
        let (gain, told) = self.gains(&samples);
        let Some(told) = told else {
            return Light {
                gain,
                past: Vec::new(),
                told: vec![1.0; lattice.height],
            };
        };
        let noise = pair.new.sigma.hypot(pair.past.sigma);
        let past = past_rows(&samples.concat(), &gain, lattice.height, noise);
        for sample in samples.iter_mut().flatten() {
            let gain = past.get(sample.past_row.round() as usize);
            let gain = gain.copied().unwrap_or(1.0);
            (sample.past, sample.misplaced) = (gain * sample.past, gain * sample.misplaced);
            sample.shifted = sample.shifted.map(|shifted| gain * shifted);
        }
        Light {
            gain: self.gains(&samples).0,
            past,
            told,
        }
    }
}

impl MeasureGain<'_, '_> {
    /// The gain of each row of the new image, and, where rows differ clearly, what each tells of its ranges besides.
    fn gains(&self, samples: &[Vec<Sample>]) -> (Vec<f32>, Option<Vec<f32>>) {
        let (pair, height) = (self.pair, self.pair.lattice.height);
        // The median does not mind the pixels that were hidden in the past.
        let mut ratios: Vec<f32> = samples
            .iter()
            .step_by(3)
            .flatten()
            .map(|sample| sample.new / sample.past)
            .collect();
        let enough = ratios.len() >= LEAST_SAMPLES;
        let Some(median) = median_mut(&mut ratios).filter(|_| enough) else {
            return (vec![1.0; height], None);
        };
        let noise = pair.new.sigma.hypot(median * pair.past.sigma);
        let fits = |sample: &&Sample| {
            let off = (sample.new - median * sample.past).abs();
            off < 4.0 * noise + ROW_CHANGE * sample.new
        };
        let mut total = Sums::default();
        let fitting = samples.iter().flatten().filter(fits);
        fitting.for_each(|sample| total.add(sample));
        if total.count < LEAST_SAMPLES as f64 {
            return (vec![1.0; height], None);
        }
        let overall = total.gain() as f32;
        let row = |row: &Vec<Sample>| {
            let mut sums = RowLight::default();
            let fitting = row.iter().filter(fits);
            fitting.for_each(|sample| sums.add(sample, overall, pair.past.sigma));
            sums
        };
        let rows: Vec<RowLight> = samples.iter().map(row).collect();
        let sigma = f64::from(noise);
        gains((&total, &rows), f64::from(median), sigma, height)
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

impl<L: Lens> RowSamples<'_, '_, L> {
    #[inline(always)]
    fn block(&self, pixels: Range<usize>, samples: &mut Vec<Sample>) {
        let (pair, lattice) = (self.pair, self.pair.lattice);
        let mut places = [[f32::NAN; TOGETHER]; 2];
        let mut off = [[f32::NAN; TOGETHER]; 2];
        let mut shift = [0.0; TOGETHER];
        let focal2 = lattice.focal_px * lattice.focal_px;
        let step = &pair.step.translation;
        let rays = lattice.ray[pixels.clone()].chunks(COLUMNS);
        let nodes = self.nodes[pixels.clone()].chunks(COLUMNS);
        for (i, (ray, node)) in rays.zip(nodes).enumerate() {
            let (ray, node) = (&ray[0], &node[0]);
            let there = pair.step.there(ray, node[0]);
            let (place, along) = self.lens.project_along(&there, step);
            [places[0][i], places[1][i]] = place;
            let deviation = node[3].sqrt();
            [off[0][i], off[1][i]] = along.map(|along| along * deviation);
            let drift = pair.drift.rotation + pair.drift.translation * node[0] * node[0];
            shift[i] = (focal2 * drift).sqrt();
        }
        let mut around = Around::new();
        lattice.around_each(&places, &mut around);
        for (i, new) in pair.new.pixel[pixels].chunks(COLUMNS).enumerate() {
            let [new, ..] = new[0];
            let four = around.four(lattice.width, i);
            let (s, t) = (around.across[i], around.down[i]);
            let [past, gx, gy, _] = read(&pair.past.pixel, four, s, t);
            let misplaced = gx * off[0][i] + gy * off[1][i];
            if past > DARK && new > DARK && misplaced.is_finite() {
                samples.push(Sample {
                    new,
                    past,
                    row: self.y as f32,
                    past_row: places[1][i],
                    misplaced,
                    shifted: [gx * shift[i], gy * shift[i]],
                });
            }
        }
    }
}

/// The new image's gain in each of `height` rows: one for all, and the smoothed deviations of the rows where
/// they are more than noise (of standard deviation `sigma`); then also what is told of ranges
/// besides. The rows are every so
/// many.
fn gains(
    (total, rows): (&Sums, &[RowLight]),
    median: f64,
    sigma: f64,
    height: usize,
) -> (Vec<f32>, Option<Vec<f32>>) {
    let (overall, level) = (total.gain(), total.past / total.count);
    let reach = (height / 40 / STEP).max(1);
    let band = |y: usize| {
        let mut band = RowLight::default();
        // As far up as down: a mean of one side would be another row's.
        let reach = reach.min(y).min(rows.len() - 1 - y);
        let around = &rows[y - reach..=y + reach];
        around.iter().for_each(|row| band.join(row));
        band
    };
    let bands: Vec<RowLight> = (0..rows.len()).map(band).collect();
    let told: Vec<f64> = bands.iter().map(RowLight::told).collect();
    let bands: Vec<(f64, f64)> = bands.iter().map(|band| band.deviation(sigma)).collect();
    let least2 = LEAST_DEVIATION * LEAST_DEVIATION;
    let clarity = |(deviation, variance): &(f64, f64)| {
        let noise2 = CLEAR * CLEAR * variance;
        deviation * deviation / (noise2 + least2)
    };
    let clear = bands.iter().map(clarity).sum::<f64>() > bands.len() as f64;
    // A light that does not change is not measured again and again: the noise of that would stay.
    // What is hidden moves the mean, a pattern the median: both must say so.
    let change = (overall - 1.0).abs().min((median - 1.0).abs());
    let noise = sigma / (total.count.sqrt() * level);
    let changed = change > LEAST_CHANGE + 4.0 * noise;
    let overall = if clear || changed { overall } else { 1.0 };
    let keep = if clear { 1.0 } else { 0.0 };
    let deviations: Vec<f64> = bands.iter().map(|(deviation, _)| *deviation).collect();
    let gain = |y| (overall * (1.0 + keep * between(&deviations, y))) as f32;
    let told = || {
        (0..height)
            .map(|y| (between(&told, y) as f32).clamp(0.0, 1.0))
            .collect()
    };
    ((0..height).map(gain).collect(), clear.then(told))
}

/// Rows differ clearly by so many standard deviations.
const CLEAR: f64 = 5.0;

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

#[cfg(test)]
#[allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to
mod tests;
