//! The median filter of a flow between its linearisations: jumps stay, single wrong pixels go.

use rayon::prelude::*;
use sphereflow_core::Plane;
use sphereflow_raster::Padded;

/// The median of each pixel over a square of `2 radius + 1` pixels, the border continued by its last pixel.
pub(super) fn median_filtered(plane: &Padded, radius: usize, out: &mut Plane<f32>) {
    let (width, _) = plane.size();
    let arch = pulp::Arch::new();
    let rows = out.data_mut().par_chunks_mut(width).enumerate();
    match radius {
        0 => plane.store(out),
        1 => rows.for_each_init(
            || vec![[0.0_f32; 3]; width],
            |sorted, (y, out)| {
                arch.dispatch(MedianRow {
                    plane,
                    y,
                    sorted,
                    out,
                });
            },
        ),
        _ => rows.for_each(|(y, out)| any_row(plane, y, radius as isize, out)),
    }
}

/// A row of squares of three pixels, compiled for wide vectors.
struct MedianRow<'a> {
    plane: &'a Padded,
    y: usize,
    /// The three values of each column by size.
    sorted: &'a mut [[f32; 3]],
    out: &'a mut [f32],
}

impl pulp::WithSimd for MedianRow<'_> {
    type Output = ();

    /// The median of nine is that of three: the largest of the columns' least values, the middle
    /// one of their middle values, the least of their largest.
    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self {
            plane,
            y,
            sorted,
            out,
        } = self;
        let (width, height) = plane.size();
        let rows = [y.saturating_sub(1), y, (y + 1).min(height - 1)];
        let [a, b, c] = rows.map(|y| &plane.row(y)[..width]);
        let (sorted, out) = (&mut sorted[..width], &mut out[..width]);
        for x in 0..width {
            let (low, high) = ordered(a[x], b[x]);
            let (high, top) = ordered(high, c[x]);
            let (low, middle) = ordered(low, high);
            sorted[x] = [low, middle, top];
        }
        let of = |l: &[f32; 3], m: &[f32; 3], r: &[f32; 3]| {
            let low = most(most(l[0], m[0]), r[0]);
            let high = least(least(l[2], m[2]), r[2]);
            middle(low, middle(l[1], m[1], r[1]), high)
        };
        out[0] = of(&sorted[0], &sorted[0], &sorted[1]);
        out[width - 1] = of(&sorted[width - 2], &sorted[width - 1], &sorted[width - 1]);
        let count = width - 2;
        let (left, right) = (&sorted[..count], &sorted[2..][..count]);
        let (own, out) = (&sorted[1..][..count], &mut out[1..][..count]);
        for i in 0..count {
            out[i] = of(&left[i], &own[i], &right[i]);
        }
    }
}

/// Compiles to one instruction each, which `f32::min` with its rule for NaN does not.
#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn most(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn ordered(a: f32, b: f32) -> (f32, f32) {
    (least(a, b), most(a, b))
}

#[inline(always)]
fn middle(a: f32, b: f32, c: f32) -> f32 {
    let (low, high) = ordered(a, b);
    most(low, least(high, c))
}

/// A row of larger squares.
fn any_row(plane: &Padded, y: usize, radius: isize, out: &mut [f32]) {
    let (width, height) = plane.size();
    let inside = |i: usize, step: isize, size: usize| i.saturating_add_signed(step).min(size - 1);
    let mut window = Vec::with_capacity(((2 * radius + 1) * (2 * radius + 1)) as usize);
    for (x, out) in out.iter_mut().enumerate() {
        window.clear();
        for dy in -radius..=radius {
            let row = plane.row(inside(y, dy, height));
            window.extend((-radius..=radius).map(|dx| row[inside(x, dx, width)]));
        }
        let half = window.len() / 2;
        *out = *window.select_nth_unstable_by(half, f32::total_cmp).1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn median_of_three_by_three_is_that_of_any_size() {
        let hash = |x: usize, y: usize| ((x * 7919 + y * 104_729) % 1013) as f32;
        let plane = Plane::from_fn(37, 11, hash);
        let (mut fast, mut any) = (plane.clone(), plane.clone());
        let padded = Padded::of(&plane);
        median_filtered(&padded, 1, &mut fast);
        for (y, out) in any.data_mut().chunks_mut(37).enumerate() {
            any_row(&padded, y, 1, out);
        }
        assert_eq!(fast, any);
    }
}
