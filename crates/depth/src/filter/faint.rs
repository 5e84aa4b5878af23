//! Slopes of faint paint: as much of them as is not noise.
//!
//! A measurement's information goes by its squared slope, and noise has slopes of its own: where there is little
//! else, it would be taken for information. The slopes around a pixel have a mean square in each direction, to
//! which noise adds the same everywhere: Wiener's share of what is left is what a slope is worth. Scaled by it, a
//! measurement is unbiased and its information is what it is. Direction matters: stripes say nothing along themselves.

use rayon::prelude::*;

/// Pixels to a side of a block, whose slopes are scaled alike; those of the blocks around it count as much.
const BLOCK: usize = 3;

/// Sums of squared slopes, by columns, both and rows; and how many.
type Sums = [f32; 4];

/// A symmetric matrix for slopes: its entries by columns, both and rows.
type Scale = [f32; 3];

/// Scales the slopes of an image `[brightness, slopes by column and row, variance]`. `noise` is the variance of each of
/// both slopes by noise. What is not finite stays.
pub(super) fn shrink(pixel: &mut [[f32; 4]], width: usize, noise: f32) {
    let columns = width.div_ceil(BLOCK);
    let sums: Vec<Sums> = pixel
        .par_chunks(BLOCK * width)
        .flat_map_iter(|rows| {
            (0..columns).map(move |column| {
                let (from, to) = (column * BLOCK, (column * BLOCK + BLOCK).min(width));
                let mut sums = [0.0; 4];
                for row in rows.chunks_exact(width) {
                    row[from..to].iter().for_each(|pixel| add(&mut sums, pixel));
                }
                sums
            })
        })
        .collect();
    let blocks = sums.len() / columns;
    pixel
        .par_chunks_mut(BLOCK * width)
        .enumerate()
        .for_each(|(y, rows)| {
            for column in 0..columns {
                let mut around = [0.0; 4];
                for row in y.saturating_sub(1)..(y + 2).min(blocks) {
                    let row = &sums[row * columns..][..columns];
                    for sums in &row[column.saturating_sub(1)..(column + 2).min(columns)] {
                        around = std::array::from_fn(|k| around[k] + sums[k]);
                    }
                }
                let [xx, xy, yy] = worth(&around, noise);
                let (from, to) = (column * BLOCK, (column * BLOCK + BLOCK).min(width));
                for row in rows.chunks_exact_mut(width) {
                    for pixel in &mut row[from..to] {
                        let [_, gx, gy, _] = *pixel;
                        (pixel[1], pixel[2]) = (xx * gx + xy * gy, xy * gx + yy * gy);
                    }
                }
            }
        });
}

#[inline(always)]
fn add(sums: &mut Sums, &[_, gx, gy, _]: &[f32; 4]) {
    let more = [gx * gx, gx * gy, gy * gy, 1.0];
    let known = (more[0] + more[2]).is_finite();
    for (sum, more) in sums.iter_mut().zip(more) {
        *sum += if known { more } else { 0.0 };
    }
}

/// The share of slopes that is not noise, along the direction in which they are largest and across it.
fn worth(&[xx, xy, yy, count]: &Sums, noise: f32) -> Scale {
    let noise = noise * count;
    let (middle, root) = (
        0.5 * (xx + yy),
        (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt(),
    );
    let share = |square: f32| {
        if square > noise {
            1.0 - noise / square
        } else {
            0.0
        }
    };
    let least = middle - root;
    let (along, across) = (share(middle + root), share(least));
    // What the direction of the largest adds, as a projection.
    let more = if root > 0.0 {
        (along - across) / (2.0 * root)
    } else {
        0.0
    };
    [
        across + more * (xx - least),
        more * xy,
        across + more * (yy - least),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Not multiples of a block.
    const WIDTH: usize = 201;
    const HEIGHT: usize = 150;
    const NOISE: f32 = 2.0;

    /// Slopes of paint with noise, and without.
    fn image(paint: impl Fn(usize, usize) -> [f32; 2]) -> [Vec<[f32; 4]>; 2] {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut draw = || {
            let value: f32 = StandardNormal.sample(&mut rng);
            NOISE.sqrt() * value
        };
        let clean: Vec<[f32; 4]> = (0..WIDTH * HEIGHT)
            .map(|i| {
                let [gx, gy] = paint(i % WIDTH, i / WIDTH);
                [7.0, gx, gy, 0.5]
            })
            .collect();
        let noisy = clean.iter().map(|pixel| {
            let [value, gx, gy, variance] = *pixel;
            [value, gx + draw(), gy + draw(), variance]
        });
        [noisy.collect(), clean]
    }

    fn mean(of: impl Iterator<Item = f32>) -> f32 {
        of.sum::<f32>() / (WIDTH * HEIGHT) as f32
    }

    #[test]
    fn slopes_of_noise_are_worth_next_to_nothing() {
        let [mut noisy, _] = image(|_, _| [0.0, 0.0]);
        shrink(&mut noisy, WIDTH, NOISE);
        // Of 81 pixels the mean square is off by a sixth.
        let left = mean(noisy.iter().map(|p| p[1] * p[1] + p[2] * p[2]));
        assert!(left < 0.03 * 2.0 * NOISE, "{left}");
        assert!(noisy.iter().all(|p| p[0] == 7.0 && p[3] == 0.5));
    }

    #[test]
    fn a_measurement_by_scaled_slopes_is_unbiased_and_claims_what_it_has() {
        // As strong as the noise, in all directions.
        let paint = |x: usize, y: usize| {
            let turn = 1.7 * x as f32 + 2.9 * y as f32;
            [turn.cos() * 2.0, turn.sin() * 2.0]
        };
        let [mut scaled, clean] = image(paint);
        shrink(&mut scaled, WIDTH, NOISE);
        // A residual of one pixel's move is the true slope; q and s are what the filter sums.
        let pairs = || scaled.iter().zip(&clean);
        let q = mean(pairs().map(|(g, paint)| g[1] * paint[1]));
        let s = mean(scaled.iter().map(|g| g[1] * g[1]));
        assert!((q / s - 1.0).abs() < 0.05, "{}", q / s);
        // Without noise the information were 2; half of the squared slopes are noise, so that half of it is left.
        assert!((s / 1.0 - 1.0).abs() < 0.05, "{s}");
    }

    #[test]
    fn stripes_say_nothing_along_themselves_however_strong() {
        let (cos, sin) = (0.6, 0.8);
        let [mut noisy, clean] = image(|x, y| {
            let height = 30.0 * (0.3 * (cos * x as f32 + sin * y as f32)).cos();
            [height * cos, height * sin]
        });
        shrink(&mut noisy, WIDTH, NOISE);
        let along = mean(noisy.iter().map(|p| (sin * p[1] - cos * p[2]).powi(2)));
        assert!(along < 0.03 * NOISE, "{along}");
        let across = mean(noisy.iter().map(|p| (cos * p[1] + sin * p[2]).powi(2)));
        let paint = mean(clean.iter().map(|p| (cos * p[1] + sin * p[2]).powi(2)));
        assert!((across / paint - 1.0).abs() < 0.01, "{across} {paint}");
    }

    #[test]
    fn without_noise_and_beside_unknown_pixels_slopes_stay() {
        let [_, mut clean] = image(|x, y| [x as f32 - 90.0, 0.1 * y as f32]);
        clean[40 * WIDTH + 60][1] = f32::NAN;
        let before = clean.clone();
        shrink(&mut clean, WIDTH, 0.0);
        for (i, (after, before)) in clean.iter().zip(&before).enumerate() {
            if i != 40 * WIDTH + 60 {
                let off = (after[1] - before[1]).hypot(after[2] - before[2]);
                assert!(off <= 1e-4 * before[1].hypot(before[2]), "{i}: {off}");
            }
        }
    }
}
