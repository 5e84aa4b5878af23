//! Bilinear samples with the border continued outwards (the condition (4.1) at inflow borders).

use sphereflow_core::Plane;

/// The two neighbours of `x` along an axis of `size` pixels, and the way between them.
#[inline]
pub fn bracket(x: f32, size: usize) -> (usize, usize, f32) {
    let last = (size - 1) as f32;
    let x = x.clamp(0.0, last);
    let low = (x as usize).min(size.saturating_sub(2));
    (low, (low + 1).min(size - 1), x - low as f32)
}

/// The bilinear value at `(x, y)`; outside the image that of the nearest border point.
#[inline]
pub fn clamped(plane: &Plane<f32>, x: f32, y: f32) -> f32 {
    let (x0, x1, s) = bracket(x, plane.width());
    let (y0, y1, t) = bracket(y, plane.height());
    blend(plane, (x0, x1, s), (y0, y1, t))
}

/// As [`clamped`] on an image that closes around from the last column to the first.
#[inline]
pub fn wrapped(plane: &Plane<f32>, x: f32, y: f32) -> f32 {
    let width = plane.width();
    let x = x.rem_euclid(width as f32);
    let low = (x as usize).min(width - 1);
    let high = if low + 1 == width { 0 } else { low + 1 };
    let (y0, y1, t) = bracket(y, plane.height());
    blend(plane, (low, high, x - low as f32), (y0, y1, t))
}

#[inline]
fn blend(plane: &Plane<f32>, x: (usize, usize, f32), y: (usize, usize, f32)) -> f32 {
    let (data, width) = (plane.data(), plane.width());
    let (top, bottom) = (y.0 * width, y.1 * width);
    let row = |start: usize| {
        let (a, b) = (data[start + x.0], data[start + x.1]);
        a + x.2 * (b - a)
    };
    let (a, b) = (row(top), row(bottom));
    a + y.2 * (b - a)
}
