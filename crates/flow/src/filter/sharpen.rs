//! Smoothing by what stands out of the noise: slopes of faint paint need much of it, edges of strong paint little.

use crate::gaussian::Gaussian;
use rayon::prelude::*;
use sphereflow_core::Plane;

/// Squared slopes over those of noise from which an image is smoothed less than more.
const STANDS_OUT: f32 = 15.0;

/// Where the sharp image has less than this much more noise, as a share, one will do.
const ALIKE: f32 = 0.3;

/// Puts the less smoothed image in where paint stands out.
#[derive(Clone, Debug)]
pub(super) struct Sharpen {
    sharp: Plane<f32>,
    wide: Plane<f32>,
    noise: Vec<f32>,
}

impl Sharpen {
    pub fn new(width: usize, height: usize) -> Self {
        Self {
            sharp: Plane::filled(width, height, 0.0),
            wide: Plane::filled(width, height, 0.0),
            noise: vec![0.0; width * height],
        }
    }

    /// Variance of comparing two such images, of every pixel, beyond that of two wide ones.
    pub fn noise(&self) -> &[f32] {
        &self.noise
    }

    /// `image` is `raw`, smoothed by the wide Gaussian, and becomes a mix with the sharp one; `sigma` is the noise of
    /// the raw image. Where a place is sharp depends on the wide image alone, so that other images of it are likewise.
    pub fn apply(
        &mut self,
        raw: &Plane<f32>,
        wraps: bool,
        (wide, sharp): (&Gaussian, &Gaussian),
        sigma: f32,
        image: &mut Plane<f32>,
    ) {
        let more = sharp.noise_gain() - wide.noise_gain();
        if more < ALIKE * wide.noise_gain() {
            self.noise.fill(0.0);
            return;
        }
        sharp.apply_to(raw, wraps, &mut self.sharp);
        std::mem::swap(image, &mut self.wide);
        let (width, arch) = (image.width(), pulp::Arch::new());
        let (wide_image, sharp_image) = (&self.wide, &self.sharp);
        let least = STANDS_OUT * wide.slope_gain() * sigma * sigma;
        let rows = image.data_mut().par_chunks_mut(width);
        rows.zip(self.noise.par_chunks_mut(width))
            .enumerate()
            .for_each(|(y, (out, noise))| {
                arch.dispatch(MixRow {
                    wide: wide_image,
                    sharp: sharp_image.row(y),
                    wraps,
                    y,
                    least,
                    // Of both images that are compared.
                    variance: 2.0 * more * sigma * sigma,
                    out,
                    noise,
                });
            });
    }
}

/// A row of the mix, compiled for wide vectors.
struct MixRow<'a> {
    wide: &'a Plane<f32>,
    sharp: &'a [f32],
    wraps: bool,
    y: usize,
    /// Squared slope at which both images have equal shares.
    least: f32,
    /// What the sharp image's noise adds.
    variance: f32,
    out: &'a mut [f32],
    noise: &'a mut [f32],
}

impl MixRow<'_> {
    #[inline(always)]
    fn mix(&mut self, x: usize, here: f32, [gx, gy]: [f32; 2]) {
        let square = gx * gx + gy * gy;
        let share = square * square / (square * square + self.least * self.least);
        self.out[x] = here + share * (self.sharp[x] - here);
        self.noise[x] = share * share * self.variance;
    }
}

impl pulp::WithSimd for MixRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(mut self, _: S) {
        let (width, height) = self.wide.size();
        let (up, down) = (self.y.saturating_sub(1), (self.y + 1).min(height - 1));
        let [a, b, c] = [up, self.y, down].map(|y| &self.wide.row(y)[..width]);
        let per_row = 1.0 / (down - up) as f32;
        for (x, left, right) in [(0, width - 1, 1), (width - 1, width - 2, 0)] {
            let (left, right, per_column) = match self.wraps {
                true => (left, right, 0.5),
                false => (left.min(x), right.max(x), 1.0),
            };
            let slopes = [(b[right] - b[left]) * per_column, (c[x] - a[x]) * per_row];
            self.mix(x, b[x], slopes);
        }
        let count = width - 2;
        let (left, right) = (&b[..count], &b[2..][..count]);
        let [a, b, c] = [a, b, c].map(|row| &row[1..][..count]);
        for x in 0..count {
            let slopes = [(right[x] - left[x]) * 0.5, (c[x] - a[x]) * per_row];
            self.mix(x + 1, b[x], slopes);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 64;
    const HEIGHT: usize = 48;
    const SIGMA: f32 = 5.0;
    /// The column of a strong edge.
    const EDGE: usize = 30;

    #[test]
    fn faint_paint_stays_smooth_and_strong_edges_become_sharp() {
        let (wide, sharp) = (Gaussian::new(1.2), Gaussian::new(0.7));
        let raw = Plane::from_fn(WIDTH, HEIGHT, |x, _| match x {
            x if x >= EDGE => 220.0,
            x if x % 4 == 0 => 41.0,
            _ => 40.0,
        });
        let smoothed = |gaussian: &Gaussian| {
            let mut out = raw.clone();
            gaussian.apply(&raw, &mut out);
            out
        };
        let (of_wide, of_sharp) = (smoothed(&wide), smoothed(&sharp));
        let mut mix = of_wide.clone();
        let mut sharpen = Sharpen::new(WIDTH, HEIGHT);
        sharpen.apply(&raw, false, (&wide, &sharp), SIGMA, &mut mix);
        let more = 2.0 * (sharp.noise_gain() - wide.noise_gain()) * SIGMA * SIGMA;
        for y in 0..HEIGHT {
            for x in (0..EDGE - 8).chain(EDGE + 8..WIDTH) {
                assert!((mix[(x, y)] - of_wide[(x, y)]).abs() < 1e-3, "{x}, {y}");
                assert!(sharpen.noise()[y * WIDTH + x] < 1e-3 * more);
            }
            for x in [EDGE - 1, EDGE] {
                let off = (mix[(x, y)] - of_sharp[(x, y)]).abs();
                assert!(off < 0.02 * (of_wide[(x, y)] - of_sharp[(x, y)]).abs());
                assert!((sharpen.noise()[y * WIDTH + x] / more - 1.0).abs() < 0.02);
            }
        }
    }

    #[test]
    fn where_both_smooth_alike_nothing_changes() {
        let raw = Plane::from_fn(WIDTH, HEIGHT, |x, y| ((x * y) % 50) as f32);
        let gaussian = Gaussian::new(0.5);
        let mut image = raw.clone();
        gaussian.apply(&raw, &mut image);
        let before = image.clone();
        let mut sharpen = Sharpen::new(WIDTH, HEIGHT);
        sharpen.apply(&raw, false, (&gaussian, &gaussian), SIGMA, &mut image);
        assert!(image == before);
        assert!(sharpen.noise().iter().all(|v| *v == 0.0));
    }
}
