//! Gaussian blur of interleaved images; beyond the border the nearest pixel is repeated.

use rayon::prelude::*;

/// Taps cover three standard deviations: 99.7 % of the Gaussian, renormalised to 1.
const REACH_SIGMAS: f64 = 3.0;

/// The right half of a normalised Gaussian, centre first.
fn half_kernel(sigma_px: f64) -> Vec<f32> {
    let reach = (REACH_SIGMAS * sigma_px).ceil() as usize;
    let tap = |d: usize| (-0.5 * (d as f64 / sigma_px).powi(2)).exp();
    let sum = 1.0 + 2.0 * (1..=reach).map(tap).sum::<f64>();
    (0..=reach).map(|d| (tap(d) / sum) as f32).collect()
}

/// Blurs `data` (rows of `width` pixels of `channels` values) by `sigma_px` above zero.
pub(crate) fn gaussian(data: &mut [f32], width: usize, channels: usize, sigma_px: f64) {
    let stride = width * channels;
    let Some(last_row) = (data.len() / stride.max(1)).checked_sub(1) else {
        return;
    };
    let kernel = half_kernel(sigma_px);
    let mut across = vec![0.0; data.len()];
    across
        .par_chunks_mut(stride)
        .zip(data.par_chunks(stride))
        .for_each(|(out, row)| blur_row(out, row, channels, &kernel));
    let row_at = |y: usize| &across[y * stride..(y + 1) * stride];
    data.par_chunks_mut(stride)
        .enumerate()
        .for_each(|(y, out)| {
            out.fill(0.0);
            for (d, weight) in kernel.iter().enumerate() {
                add_scaled(out, row_at((y + d).min(last_row)), *weight);
                if d > 0 {
                    add_scaled(out, row_at(y.saturating_sub(d)), *weight);
                }
            }
        });
}

fn add_scaled(out: &mut [f32], row: &[f32], weight: f32) {
    out.iter_mut().zip(row).for_each(|(o, v)| *o += weight * v);
}

fn blur_row(out: &mut [f32], row: &[f32], channels: usize, kernel: &[f32]) {
    let last = row.len() / channels - 1;
    for (x, pixel) in out.chunks_exact_mut(channels).enumerate() {
        for (c, value) in pixel.iter_mut().enumerate() {
            let at = |x: usize| row[x * channels + c];
            let mut sum = 0.0;
            for (d, weight) in kernel.iter().enumerate() {
                let left = if d > 0 { at(x.saturating_sub(d)) } else { 0.0 };
                sum += weight * (left + at((x + d).min(last)));
            }
            *value = sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The truncation at three sigmas narrows the kernel by under 2 %.
    const WIDTH_TOLERANCE: f64 = 0.03;

    #[test]
    fn gaussian_blur_of_a_point_has_the_stated_width_and_keeps_the_sum_and_channels_apart() {
        let (width, height, sigma) = (41, 31, 2.0);
        let mut data = vec![0.0; width * height * 2];
        data[(15 * width + 20) * 2] = 1000.0;
        gaussian(&mut data, width, 2, sigma);
        let (mut sum, mut across, mut down) = (0.0, 0.0, 0.0);
        for (i, pixel) in data.chunks_exact(2).enumerate() {
            let (x, y, v) = (i % width, i / width, f64::from(pixel[0]));
            sum += v;
            across += v * (x as f64 - 20.0).powi(2);
            down += v * (y as f64 - 15.0).powi(2);
            assert_eq!(pixel[1], 0.0, "the other channel received light");
        }
        assert!((sum - 1000.0).abs() < 0.01, "{sum}");
        for variance in [across / sum, down / sum] {
            assert!(
                (variance.sqrt() / sigma - 1.0).abs() < WIDTH_TOLERANCE,
                "{variance}"
            );
        }
    }

    #[test]
    fn gaussian_blur_of_a_constant_image_is_the_constant_up_to_the_border() {
        let mut data = vec![7.0; 12 * 3];
        gaussian(&mut data, 12, 1, 5.0);
        // Rounding of about 30 f32 products.
        assert!(data.iter().all(|v| (v - 7.0).abs() < 1e-5), "{data:?}");
    }
}
