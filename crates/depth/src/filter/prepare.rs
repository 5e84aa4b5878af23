//! From a camera's image to the filter's: noise measured, impulses out, binned, smoothed, with slopes.

use super::faint::shrink;
use super::impulses::{has_impulses, without_impulses};
use super::lattice::Lattice;
use rayon::prelude::*;
use sphereflow_core::Plane;
use sphereflow_raster::{BLACK, Gaussian, SATURATED, median_noise};

/// An image as the filter reads it.
#[derive(Clone, Debug)]
pub(super) struct Prepared {
    /// Brightness, slopes by column and row, variance of reading it between pixels; brightness NaN where
    /// unknown.
    pub pixel: Vec<[f32; 4]>,
    /// Standard deviation of the noise of a pixel after binning, before smoothing.
    pub sigma_raw: f32,
    /// The same after smoothing.
    pub sigma: f32,
    /// Whether impulses were found: those that stay are far from normal noise.
    pub impulses: bool,
    /// Pixels of the image's border that smoothing spoils.
    pub margin: f32,
    /// Share of known pixels.
    pub known: f32,
    /// Share of pixels with a slope that is more than noise.
    pub textured: f32,
}

/// Buffers between the steps, kept from image to image.
#[derive(Clone, Debug)]
pub(super) struct Preparation {
    binning: usize,
    binned: Plane<f32>,
    smooth: Plane<f32>,
    /// Noise measured so far, grey levels.
    measured: Option<f32>,
}

/// No image is read more exactly than this between its pixels, whatever the camera's noise.
const LEAST_SIGMA: f32 = 1.0;

/// Noise of images with impulses, grey levels, of which some do not stand out enough to be replaced: an image taken
/// for a better one is trusted the more the less the camera moves. From the deviations and errors of simulated rooms.
const LEFT_BY_IMPULSES: f32 = 6.0;

/// Standard deviation of the smoothing, pixels: without noise, and what ten grey levels of it add. More is no better
/// for faint paint, whose slopes are scaled, and blurs edges.
const LEAST_SMOOTHING: f32 = 0.5;
const SMOOTHING: f32 = 0.3;

impl Preparation {
    pub fn new(width: usize, height: usize, binning: usize) -> Self {
        Self {
            binning,
            binned: Plane::filled(width, height, 0.0),
            smooth: Plane::filled(width, height, 0.0),
            measured: None,
        }
    }

    /// Works on the buffers of an image no longer needed.
    pub fn prepare(
        &mut self,
        image: &Plane<f32>,
        lattice: &Lattice,
        sigma: Option<f64>,
        mut out: Prepared,
    ) -> Prepared {
        let sigma = sigma.map_or_else(|| self.measure_noise(image), |s| s as f32);
        let impulses = has_impulses(image, sigma);
        let cleaned = impulses.then(|| without_impulses(image, sigma));
        self.bin(cleaned.as_ref().unwrap_or(image));
        let sigma = if impulses {
            sigma.max(LEFT_BY_IMPULSES)
        } else {
            sigma
        };
        out.impulses = impulses;
        out.known = self.fill_unknown();
        // Little noise wants little smoothing; ten grey levels and more about a pixel.
        let raw = (sigma / self.binning as f32).max(LEAST_SIGMA / self.binning as f32);
        let noisy = (sigma / 10.0).min(1.0);
        let gaussian = Gaussian::new(LEAST_SMOOTHING + SMOOTHING * noisy);
        gaussian.apply_to(&self.binned, lattice.wraps, &mut self.smooth);
        out.sigma_raw = raw;
        out.sigma = raw * gaussian.noise_gain().sqrt();
        self.slopes(lattice, &gaussian, &mut out);
        // Without the least noise: that stands for errors of reading, which slopes have not.
        let noise = (sigma / self.binning as f32).powi(2);
        shrink(
            &mut out.pixel,
            lattice.width,
            0.5 * gaussian.slope_gain() * noise,
        );
        out
    }

    /// The noise measured so far, with this image's.
    fn measure_noise(&mut self, image: &Plane<f32>) -> f32 {
        let found = median_noise(image);
        let now = match (self.measured, found) {
            (Some(before), Some(found)) => before + 0.1 * (found - before),
            (before, found) => found.or(before).unwrap_or(LEAST_SIGMA),
        };
        self.measured = Some(now);
        now.max(LEAST_SIGMA)
    }

    fn bin(&mut self, image: &Plane<f32>) {
        let (width, factor) = (self.binned.width(), self.binning);
        if factor == 1 {
            self.binned.data_mut().copy_from_slice(image.data());
            return;
        }
        let arch = pulp::Arch::new();
        let rows = self.binned.data_mut().par_chunks_mut(width);
        rows.enumerate().for_each(|(y, out)| {
            arch.dispatch(BinRow {
                image,
                factor,
                y,
                out,
            });
        });
    }

    /// Unknown pixels spoil those that smoothing reaches from them: they and their neighbours stay
    /// NaN. Returns the share of known pixels.
    fn fill_unknown(&mut self) -> f32 {
        let unknown = self.binned.data().iter().filter(|v| !v.is_finite()).count();
        for value in self.binned.data_mut() {
            if !value.is_finite() {
                *value = f32::NAN;
            }
        }
        1.0 - unknown as f32 / self.binned.data().len() as f32
    }

    fn slopes(&self, lattice: &Lattice, gaussian: &Gaussian, out: &mut Prepared) {
        let (width, height) = self.smooth.size();
        let (smooth, arch) = (&self.smooth, pulp::Arch::new());
        out.pixel.resize(width * height, [0.0; 4]);
        out.pixel
            .par_chunks_mut(width)
            .enumerate()
            .for_each(|(y, row)| {
                arch.dispatch(SlopeRow {
                    smooth,
                    wraps: lattice.wraps,
                    y,
                    row,
                });
            });
        hide_border(&mut out.pixel, lattice, gaussian.margin());
        out.margin = gaussian.margin() as f32;
        // Squared slopes against those of noise, in blocks: each pixel may drown, the image may not.
        let least = 2.0 * gaussian.slope_gain() * out.sigma_raw * out.sigma_raw;
        let textured = textured_share(&out.pixel, width, least);
        let flat = |v: &f32| *v <= BLACK || *v >= SATURATED;
        let useless = smooth.data().iter().filter(|v| flat(v)).count();
        let pixels = (width * height) as f32;
        out.textured = textured.min(1.0 - useless as f32 / pixels);
    }
}

/// A row of means over squares of pixels, compiled for wide vectors.
struct BinRow<'a> {
    image: &'a Plane<f32>,
    factor: usize,
    y: usize,
    out: &'a mut [f32],
}

impl pulp::WithSimd for BinRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        match self.factor {
            2 => self.mean::<2>(),
            3 => self.mean::<3>(),
            _ => self.mean::<4>(),
        }
    }
}

impl BinRow<'_> {
    #[inline(always)]
    fn mean<const N: usize>(self) {
        let scale = 1.0 / (N * N) as f32;
        let rows: [&[[f32; N]]; N] =
            std::array::from_fn(|k| self.image.row(self.y * N + k).as_chunks().0);
        let rows = rows.map(|row| &row[..self.out.len()]);
        for (x, out) in self.out.iter_mut().enumerate() {
            let mut sum = 0.0;
            for row in rows {
                for value in row[x] {
                    sum += value;
                }
            }
            *out = scale * sum;
        }
    }
}

/// Brightness and slopes of a row, compiled for wide vectors.
struct SlopeRow<'a> {
    smooth: &'a Plane<f32>,
    wraps: bool,
    y: usize,
    row: &'a mut [[f32; 4]],
}

impl pulp::WithSimd for SlopeRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let (width, height) = self.smooth.size();
        let (up, down) = (self.y.saturating_sub(1), (self.y + 1).min(height - 1));
        let span = 1.0 / (down - up) as f32;
        let [a, b, c] = [up, self.y, down].map(|y| &self.smooth.row(y)[..width]);
        for (x, left, right) in [(0, width - 1, 1), (width - 1, width - 2, 0)] {
            let (left, right, span_x) = match self.wraps {
                true => (left, right, 0.5),
                false => (left.min(x), right.max(x), 1.0),
            };
            let gx = (b[right] - b[left]) * span_x;
            let (gy, variance) = (
                (c[x] - a[x]) * span,
                reading(b[left], b[x], b[right], a[x], c[x]),
            );
            self.row[x] = [b[x], gx, gy, variance];
        }
        let count = width - 2;
        let (left, right) = (&b[..count], &b[2..][..count]);
        let [a, b, c] = [a, b, c].map(|row| &row[1..][..count]);
        let row = &mut self.row[1..][..count];
        for x in 0..count {
            let gx = (right[x] - left[x]) * 0.5;
            let (gy, variance) = (
                (c[x] - a[x]) * span,
                reading(left[x], b[x], right[x], a[x], c[x]),
            );
            row[x] = [b[x], gx, gy, variance];
        }
    }
}

/// Share of the squared second differences that is the variance of reading an image between its pixels, and of
/// what binning makes of paint finer than its pixels: chosen on simulated rooms without noise.
const READING: f32 = 0.1;

/// Variance of brightness read about a pixel, from those left, here, right, above and below.
#[inline(always)]
fn reading(left: f32, here: f32, right: f32, above: f32, below: f32) -> f32 {
    let (across, down) = (left - 2.0 * here + right, above - 2.0 * here + below);
    READING * (across * across + down * down)
}

/// Smoothing does not know what lies beyond the image: pixels of the border it bends are unknown.
fn hide_border(pixel: &mut [[f32; 4]], lattice: &Lattice, margin: usize) {
    let (width, height) = (lattice.width, lattice.height);
    let hide = |pixels: &mut [[f32; 4]]| pixels.iter_mut().for_each(|pixel| pixel[0] = f32::NAN);
    for (y, row) in pixel.chunks_exact_mut(width).enumerate() {
        if y < margin || y + margin >= height {
            hide(row);
        } else if !lattice.wraps {
            hide(&mut row[..margin]);
            hide(&mut row[width - margin..]);
        }
    }
}

/// Share of blocks whose mean squared slope is above `least`.
fn textured_share(pixels: &[[f32; 4]], width: usize, least: f32) -> f32 {
    /// Columns and rows of a block: its mean of noise alone stays well below twice what is expected.
    const BLOCK: (usize, usize) = (16, 8);
    let (mut blocks, mut textured) = (0_usize, 0_usize);
    for rows in pixels.chunks(width * BLOCK.1) {
        for first in (0..width).step_by(BLOCK.0) {
            let (mut sum, mut count) = (0.0_f32, 0.0_f32);
            for row in rows.chunks_exact(width) {
                for [_, gx, gy, _] in &row[first..(first + BLOCK.0).min(width)] {
                    let square = gx * gx + gy * gy;
                    if square.is_finite() {
                        sum += square;
                        count += 1.0;
                    }
                }
            }
            blocks += 1;
            textured += usize::from(sum > least * count);
        }
    }
    textured as f32 / blocks.max(1) as f32
}

impl Prepared {
    pub fn empty() -> Self {
        Self {
            pixel: Vec::new(),
            sigma_raw: 1.0,
            sigma: 1.0,
            impulses: false,
            margin: 0.0,
            known: 0.0,
            textured: 0.0,
        }
    }

    /// The same image in the light of another one: each row times its gain.
    pub fn lit(&self, gain: &[f32], width: usize) -> Self {
        let mut lit = self.clone();
        let last = gain.len().saturating_sub(1);
        for (y, row) in lit.pixel.chunks_exact_mut(width).enumerate() {
            let (up, down) = (y.saturating_sub(1), (y + 1).min(last));
            let slope = (gain[down] - gain[up]) / (down - up) as f32;
            for [value, gx, gy, variance] in row {
                *gy = *gy * gain[y] + *value * slope;
                *gx *= gain[y];
                *value *= gain[y];
                *variance *= gain[y] * gain[y];
            }
        }
        lit
    }
}
