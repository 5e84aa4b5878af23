//! Impulses (salt and pepper): whether an image has any, and the image without them.

use rayon::prelude::*;
use sphereflow_core::Plane;

/// A pixel is an impulse where it stands out of its eight neighbours by far more than the noise.
fn is_impulse(window: &mut [f32; 9], centre: f32, sigma: f32) -> Option<f32> {
    window.sort_unstable_by(f32::total_cmp);
    // Up to two more impulses among the neighbours do not count.
    let (median, low, high) = (window[4], window[2], window[6]);
    let stands_out = (centre - median).abs() > (6.0 * sigma).max(20.0) + 2.0 * (high - low);
    stands_out.then_some(median)
}

fn window(image: &Plane<f32>, x: usize, y: usize) -> [f32; 9] {
    let rows = [image.row(y - 1), image.row(y), image.row(y + 1)];
    std::array::from_fn(|i| rows[i / 3][x - 1 + i % 3])
}

/// Looks at one pixel of sixteen: more impulses than one in 500 is no accident.
pub(super) fn has_impulses(image: &Plane<f32>, sigma: f32) -> bool {
    let (width, height) = image.size();
    let (mut seen, mut found) = (0_usize, 0_usize);
    for y in (1..height.saturating_sub(1)).step_by(4) {
        let row = image.row(y);
        for x in (1..width.saturating_sub(1)).step_by(4) {
            seen += 1;
            // Only a pixel far from its left and right neighbours can be one: most are not.
            let far = (row[x] - row[x - 1]).abs().min((row[x] - row[x + 1]).abs());
            if far > (6.0 * sigma).max(20.0) {
                found += usize::from(is_impulse(&mut window(image, x, y), row[x], sigma).is_some());
            }
        }
    }
    found * 500 > seen
}

/// Impulses replaced by the median of their neighbourhood.
pub(super) fn without_impulses(image: &Plane<f32>, sigma: f32) -> Plane<f32> {
    let mut out = image.clone();
    let (width, height) = image.size();
    if height < 3 {
        return out;
    }
    let arch = pulp::Arch::new();
    let rows = out.data_mut().par_chunks_mut(width).enumerate();
    rows.skip(1).take(height - 2).for_each_init(
        || vec![0_u8; width],
        |alike, (y, out)| {
            arch.dispatch(Alike {
                rows: [image.row(y - 1), image.row(y), image.row(y + 1)],
                far: (6.0 * sigma).max(20.0),
                alike,
            });
            for x in 1..width.saturating_sub(1) {
                // The median of nine is as near as five of them are.
                if alike[x] < 5 {
                    let found = is_impulse(&mut window(image, x, y), image[(x, y)], sigma);
                    out[x] = found.unwrap_or(out[x]);
                }
            }
        },
    );
    out
}

/// How many of the nine pixels around each one of a row are near it, itself among them: compiled for wide
/// vectors.
struct Alike<'a> {
    rows: [&'a [f32]; 3],
    far: f32,
    alike: &'a mut [u8],
}

impl pulp::WithSimd for Alike<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let count = self.alike.len().saturating_sub(2);
        let alike = &mut self.alike[1..][..count];
        alike.fill(0);
        let centre = &self.rows[1][1..][..count];
        for (row, first) in (0..9).map(|i| (i / 3, i % 3)) {
            let other = &self.rows[row][first..][..count];
            for ((alike, other), centre) in alike.iter_mut().zip(other).zip(centre) {
                *alike += u8::from((other - centre).abs() <= self.far);
            }
        }
    }
}
