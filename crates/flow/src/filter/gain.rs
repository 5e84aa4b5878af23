//! How much brighter the new image is than a past one, measured between warped images.
//!
//! Where ranges or poses are off, rows look brighter or darker as well: what an error explains that the ranges of a
//! row's pixels have in common, or their places, within their deviation, is not taken for light.

use super::lattice::{Around, LensCall, read};
use super::lens::Lens;
use super::pair::Pair;
use super::rolling::{Sample, past_rows};
use super::state::Node;
use nalgebra::{Matrix4, Vector4};
use rayon::prelude::*;
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
        if ratios.len() < LEAST_SAMPLES {
            return (vec![1.0; height], None);
        }
        let middle = ratios.len() / 2;
        let (_, median, _) = ratios.select_nth_unstable_by(middle, f32::total_cmp);
        let median = *median;
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
            let mut sums = RowSums::default();
            let fitting = row.iter().filter(fits);
            fitting.for_each(|sample| sums.add(sample, overall, pair.past.sigma));
            sums
        };
        let rows: Vec<RowSums> = samples.iter().map(row).collect();
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

/// Samples that are worked on together.
const TOGETHER: usize = 64;

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
            if past > DARK && new > DARK {
                samples.push(Sample {
                    new,
                    past,
                    row: self.y as f32,
                    past_row: places[1][i],
                    misplaced: gx * off[0][i] + gy * off[1][i],
                    shifted: [gx * shift[i], gy * shift[i]],
                });
            }
        }
    }
}

/// The least squares of a band of rows: what it is brighter by than the image, and by how many of their deviations
/// its ranges are off in common, and its places by column and row. The last three are known to be about one.
#[derive(Clone, Copy, Debug, Default)]
struct RowSums {
    matrix: Matrix4<f64>,
    vector: Vector4<f64>,
}

impl RowSums {
    /// `sigma` of the past brightness, whose noise is in its square.
    fn add(&mut self, sample: &Sample, overall: f32, sigma: f32) {
        let [right, below] = sample.shifted;
        let by = Vector4::new(sample.past, sample.misplaced, right, below);
        let by = (by * overall).cast::<f64>();
        let left = f64::from(sample.new) - by[0];
        let noise2 = f64::from(overall * sigma).powi(2);
        self.matrix += by * by.transpose();
        self.vector += by * left;
        self.matrix[(0, 0)] -= noise2;
        self.vector[0] += noise2;
    }

    fn join(&mut self, other: &Self) {
        self.matrix += other.matrix;
        self.vector += other.vector;
    }

    /// Share of what the band says of its ranges that light could not explain as well.
    fn told(&self) -> f64 {
        let alike = self.matrix[(0, 1)].powi(2);
        let both = self.matrix[(0, 0)] * self.matrix[(1, 1)];
        if alike < both {
            1.0 - alike / both
        } else {
            0.0
        }
    }

    /// Share by which the band is brighter than the image, and its variance, for residuals' noise of standard
    /// deviation `sigma`.
    fn deviation(&self, sigma: f64) -> (f64, f64) {
        let noise2 = sigma * sigma;
        let known = Vector4::new(LIKELY.powi(-2), 1.0, 1.0, 1.0);
        let matrix = self.matrix + Matrix4::from_diagonal(&(noise2 * known));
        match matrix.cholesky() {
            Some(factor) => {
                let variance = noise2 * factor.inverse()[(0, 0)];
                (factor.solve(&self.vector)[0], variance)
            }
            None => (0.0, LIKELY * LIKELY),
        }
    }
}

/// Share by which a row may well be brighter than the image.
const LIKELY: f64 = 0.1;

/// The new image's gain in each of `height` rows: one for all, and the smoothed deviations of the rows where
/// they are more than noise (of standard deviation `sigma`); then also what is told of ranges besides. The rows are every so
/// many.
fn gains(
    (total, rows): (&Sums, &[RowSums]),
    median: f64,
    sigma: f64,
    height: usize,
) -> (Vec<f32>, Option<Vec<f32>>) {
    let (overall, level) = (total.gain(), total.past / total.count);
    let reach = (height / 40 / STEP).max(1);
    let band = |y: usize| {
        let mut band = RowSums::default();
        // As far up as down: a mean of one side would be another row's.
        let reach = reach.min(y).min(rows.len() - 1 - y);
        let around = &rows[y - reach..=y + reach];
        around.iter().for_each(|row| band.join(row));
        band
    };
    let bands: Vec<RowSums> = (0..rows.len()).map(band).collect();
    let told: Vec<f64> = bands.iter().map(RowSums::told).collect();
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
mod tests {
    use super::*;
    use crate::filter::lattice::Lattice;
    use crate::filter::predict::Step;
    use crate::filter::prepare::{Preparation, Prepared};
    use crate::filter::state::Drift;
    use nalgebra::{Rotation3, Vector3};
    use sphereflow_core::Plane;
    use sphereflow_sphere::Camera;

    const WIDTH: usize = 160;
    const HEIGHT: usize = 120;
    /// The painted wall stands this far before both cameras, metres; the new one is lower.
    const WALL_M: f64 = 2.0;
    const STEP_M: f64 = 0.05;
    /// By which 1/Z is too large where it is wrong, and its deviation then, as shares.
    const OFF: f32 = 0.2;
    /// Gains are lines between rows, and means over bands of them.
    const WITHIN: f32 = 0.01;

    /// Light that runs over the rows.
    fn light(y: usize) -> f32 {
        1.0 + 0.08 * (std::f32::consts::TAU * y as f32 / HEIGHT as f32).sin()
    }

    /// What a camera at (0, y, 0) sees of the wall: stripes across its motion, and along it.
    fn view(lattice: &Lattice, y_m: f64, stripes: [f64; 2], lit: bool) -> Prepared {
        let image = Plane::from_fn(WIDTH, HEIGHT, |x, y| {
            let ray = lattice.ray[y * WIDTH + x].cast::<f64>();
            let (x_m, y_m) = (ray.x / ray.z * WALL_M, ray.y / ray.z * WALL_M + y_m);
            let waves = stripes[0] * (11.0 * y_m).sin() + stripes[1] * (9.0 * x_m).sin();
            let light = if lit { light(y) } else { 1.0 };
            light * (128.0 + waves) as f32
        });
        let mut preparation = Preparation::new(WIDTH, HEIGHT, 1);
        preparation.prepare(&image, lattice, Some(1.0), Prepared::empty())
    }

    /// The gains of the new image's rows over those of a past one that was lit evenly.
    fn measured(stripes: [f64; 2], lit: bool, off: f32) -> Light {
        measured_turned(stripes, lit, off, (0.0, Drift::default()))
    }

    /// The same where the new camera is told to look higher than it does, by pixels, and how well that is known.
    fn measured_turned(
        stripes: [f64; 2],
        lit: bool,
        off: f32,
        (turned_px, drift): (f32, Drift),
    ) -> Light {
        let camera = Camera::pinhole(150.0, 150.0, 79.5, 59.5, WIDTH, HEIGHT).unwrap();
        let lattice = Lattice::new(&camera).unwrap();
        let new = view(&lattice, STEP_M, stripes, lit);
        let past = view(&lattice, 0.0, stripes, false);
        let pair = Pair {
            lattice: &lattice,
            step: Step {
                rotation: *Rotation3::new(Vector3::x() * (turned_px / 150.0)).matrix(),
                translation: Vector3::new(0.0, STEP_M as f32, 0.0),
            },
            new: &new,
            past: &past,
            surface: &[],
            gain: Vec::new(),
            told: Vec::new(),
            drift,
            lag: 1,
            repeats: 1.0,
        };
        let zeta = (1.0 / WALL_M) as f32;
        let deviation = off.max(1e-3) * zeta;
        let node = [(1.0 + off) * zeta, 0.0, 1.0, deviation * deviation];
        let nodes = vec![node; WIDTH * HEIGHT];
        lattice.lens.with(MeasureGain {
            pair: &pair,
            nodes: &nodes,
        })
    }

    /// Largest relative error of the rows' gains, away from the border that smoothing spoils.
    fn largest_error(found: &Light, lit: bool) -> f32 {
        let past = |y: usize| found.past.get(y).copied().unwrap_or(1.0);
        let off = |y: usize| {
            let expected = if lit { light(y) } else { 1.0 };
            // By the wall's distance and the step, rows have moved by four.
            (found.gain[y] * past(y + 4) / expected - 1.0).abs()
        };
        (8..HEIGHT - 12).map(off).fold(0.0, f32::max)
    }

    #[test]
    fn rows_of_stripes_that_wrong_ranges_misplace_are_not_taken_for_light() {
        let found = measured([40.0, 0.0], false, OFF);
        assert!(found.past.is_empty());
        let off = largest_error(&found, false);
        assert!(off < WITHIN, "{off}");
    }

    #[test]
    fn rows_of_stripes_that_wrong_poses_shift_are_not_taken_for_light() {
        let told = Drift {
            rotation: (1.0_f32 / 150.0).powi(2),
            translation: 0.0,
        };
        let error = |drift: Drift| {
            let found = measured_turned([40.0, 0.0], false, 0.0, (1.0, drift));
            largest_error(&found, false)
        };
        assert!(error(told) < WITHIN, "{}", error(told));
        // A pose that is told to be exact leaves nothing but light.
        assert!(error(Drift::default()) > WITHIN);
    }

    #[test]
    fn light_over_the_rows_is_found_where_ranges_are_known() {
        for stripes in [[40.0, 0.0], [0.0, 40.0], [30.0, 30.0]] {
            let off = largest_error(&measured(stripes, true, 0.0), true);
            assert!(off < WITHIN, "{stripes:?}: {off}");
        }
    }

    #[test]
    fn light_over_the_rows_is_found_in_stripes_that_ranges_do_not_move() {
        let off = largest_error(&measured([0.0, 40.0], true, OFF), true);
        assert!(off < WITHIN, "{off}");
    }

    #[test]
    fn light_over_the_rows_is_told_from_a_common_error_of_ranges() {
        let off = largest_error(&measured([30.0, 30.0], true, OFF), true);
        assert!(off < 2.0 * WITHIN, "{off}");
    }

    #[test]
    fn what_a_band_is_brighter_by_is_uncertain_where_misplaced_ranges_look_alike() {
        let band = |misplaced: fn(usize) -> f32| {
            let mut sums = RowSums::default();
            for x in 0..400 {
                let sample = Sample {
                    new: 106.0,
                    past: 100.0,
                    row: 0.0,
                    past_row: 0.0,
                    misplaced: misplaced(x),
                    shifted: [0.0; 2],
                };
                sums.add(&sample, 1.0, 0.0);
            }
            (sums.deviation(2.0), sums.told())
        };
        // Paint of both signs: light it is, and of ranges all is told. Of one: 6 % may be either, by what both are
        // expected to be.
        let ((deviation, variance), told) = band(|x| if x % 2 == 0 { 6.0 } else { -6.0 });
        assert!((deviation - 0.06).abs() < 1e-5 && variance.sqrt() < 0.002);
        assert!((told - 1.0).abs() < 1e-9, "{told}");
        let ((_, variance), told) = band(|_| 6.0);
        let expected = 0.06 * LIKELY / LIKELY.hypot(0.06);
        assert!((variance.sqrt() - expected).abs() < 1e-3, "{variance}");
        assert!(told < 1e-9, "{told}");
    }
}
