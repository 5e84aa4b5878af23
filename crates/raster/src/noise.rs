//! How noisy an image is, from its calmest places.

use pulp::Simd;
use sphereflow_core::Plane;
use sphereflow_core::statistics::median_mut;

/// Pixels of a block each way.
const BLOCK: usize = 8;

/// Share of blocks that are calmer than the one that is taken: few images are textured everywhere.
const CALM: f32 = 0.05;

/// What a block at that place in the order reads of normal noise of one (tested).
const READING: f32 = 0.756;

/// Fewer blocks say nothing.
const FEWEST: usize = 12;

/// Brightness from which a pixel counts as saturated (of 256).
pub const SATURATED: f32 = 255.0;
/// Brightness up to which a pixel counts as black (of 256): it has no noise, and says nothing of that of others.
pub const BLACK: f32 = 1.0;

/// The standard deviation of the noise between neighbouring pixels, grey levels; zero where nothing can be said.
///
/// Immerkaer's kernel, a second difference both ways, is blind to slopes and bends; its mean
/// absolute response is taken over blocks, and of every second row of blocks the calmest count.
pub fn measured_noise(image: &Plane<f32>) -> f32 {
    let mut blocks = pulp::Arch::new().dispatch(Blocks { image });
    if blocks.len() < FEWEST {
        return 0.0;
    }
    let place = (CALM * blocks.len() as f32) as usize;
    *blocks.select_nth_unstable_by(place, f32::total_cmp).1 / READING
}

/// As [`measured_noise`], by the median response of the kernel over all usable pixels (every
/// fifth each way): half of them
/// may be on edges. `None` where under a hundred say anything.
pub fn median_noise(image: &Plane<f32>) -> Option<f32> {
    /// Pixels from one that is asked to the next, each way.
    const STEP: usize = 5;
    /// Fewer responses say nothing.
    const LEAST: usize = 100;
    /// Root of the sum of the squared kernel, 36.
    const KERNEL_NORM: f32 = 6.0;
    /// Median of the magnitude of normal noise of one.
    const MEDIAN: f32 = 0.6745;
    let (width, height) = image.size();
    let mut responses = Vec::with_capacity(width * height / (STEP * STEP));
    for y in (1..height.saturating_sub(1)).step_by(STEP) {
        let (a, b, c) = (image.row(y - 1), image.row(y), image.row(y + 1));
        for x in (1..width.saturating_sub(1)).step_by(STEP) {
            let second = |r: &[f32]| r[x - 1] - 2.0 * r[x] + r[x + 1];
            let response = (second(a) - 2.0 * second(b) + second(c)).abs();
            let usable = b[x] > BLACK && b[x] < SATURATED;
            if usable && response.is_finite() {
                responses.push(response);
            }
        }
    }
    let enough = responses.len() >= LEAST;
    let median = median_mut(&mut responses).filter(|_| enough)?;
    Some(median / (KERNEL_NORM * MEDIAN))
}

/// The mean absolute response in each usable block, compiled for wide vectors.
struct Blocks<'a> {
    image: &'a Plane<f32>,
}

impl pulp::WithSimd for Blocks<'_> {
    type Output = Vec<f32>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<f32> {
        // The kernel's squares add up to 36; the mean of |normal| is the root of 2/pi.
        let scale = 1.0 / (6.0 * (2.0 / std::f32::consts::PI).sqrt() * (BLOCK * BLOCK) as f32);
        let (width, height) = self.image.size();
        let mut found = Vec::with_capacity(width * height / (2 * BLOCK * BLOCK));
        let count = width.saturating_sub(2);
        let mut sums = vec![0.0_f32; count];
        for top in (1..height.saturating_sub(BLOCK)).step_by(2 * BLOCK) {
            sums.fill(0.0);
            for y in top..top + BLOCK {
                let rows = [y - 1, y, y + 1].map(|y| self.image.row(y));
                add_responses(rows, &mut sums);
            }
            let blocks = sums.as_chunks::<BLOCK>().0;
            let means = blocks.iter().map(|block| scale * block.iter().sum::<f32>());
            // Black, saturated and unknown pixels have no noise: their blocks say nothing.
            found.extend(means.filter(|mean| mean.is_finite()));
        }
        found
    }
}

/// Adds the absolute responses of a row; infinity for pixels that say nothing.
#[inline(always)]
fn add_responses([a, b, c]: [&[f32]; 3], sums: &mut [f32]) {
    let count = sums.len();
    let [al, am, ar] = [0, 1, 2].map(|i| &a[i..][..count]);
    let [bl, bm, br] = [0, 1, 2].map(|i| &b[i..][..count]);
    let [cl, cm, cr] = [0, 1, 2].map(|i| &c[i..][..count]);
    for i in 0..count {
        let outer = (al[i] + ar[i]) + (cl[i] + cr[i]) - 2.0 * (am[i] + cm[i]);
        let response = (outer - 2.0 * (bl[i] - 2.0 * bm[i] + br[i])).abs();
        let usable = bm[i] > BLACK && bm[i] < SATURATED;
        sums[i] += if usable { response } else { f32::INFINITY };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// A smooth texture and a bent ramp beside each other, with noise.
    fn noisy(sigma: f32) -> Plane<f32> {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        Plane::from_fn(320, 240, |x, y| {
            let (x, y) = (x as f32, y as f32);
            let smooth = 128.0 + 40.0 * (0.2 * x + 0.1 * y).sin() + 1e-3 * (x - y) * (x + y);
            let normal: f32 = StandardNormal.sample(&mut rng);
            smooth + sigma * normal
        })
    }

    #[test]
    fn measured_noise_is_that_put_in() {
        for sigma in [1.0_f32, 3.0, 10.0] {
            let found = measured_noise(&noisy(sigma));
            // One order statistic of 600 blocks.
            assert!((found / sigma - 1.0).abs() < 0.08, "{sigma}: {found}");
        }
        for sigma in [3.0_f32, 10.0] {
            let found = median_noise(&noisy(sigma)).unwrap();
            // The median of 3072 responses: two deviations of it are 6 %.
            assert!((found / sigma - 1.0).abs() < 0.06, "{sigma}: {found}");
        }
        let exact = measured_noise(&noisy(0.0));
        assert!(exact < 0.3, "{exact}");
    }

    #[test]
    fn measured_noise_of_saturated_unknown_or_tiny_images_is_none() {
        let mut image = noisy(10.0);
        for value in image.data_mut().iter_mut().step_by(7) {
            *value = f32::NAN;
        }
        assert_eq!(measured_noise(&image), 0.0);
        assert_eq!(median_noise(&Plane::filled(640, 480, 255.0)), None);
        assert_eq!(median_noise(&Plane::filled(2, 1, 7.0)), None);
        assert_eq!(measured_noise(&Plane::filled(640, 480, 255.0)), 0.0);
        assert_eq!(measured_noise(&Plane::filled(2, 1, 7.0)), 0.0);
    }

    #[test]
    fn measured_noise_is_not_fooled_by_paint_on_most_of_the_image() {
        // Nine columns of ten hold edges of 100 grey levels.
        let mut image = noisy(3.0);
        for y in 0..240 {
            for x in (0..320).filter(|x| x % 40 < 24 && (x + y) % 5 < 2) {
                image[(x, y)] += 60.0;
            }
        }
        let found = measured_noise(&image);
        assert!((2.5..4.0).contains(&found), "{found}");
    }
}
