//! What goes on between the linearisations: warped images, smaller images, median filters.

use super::solver::Warped;
use crate::FlowField;
use crate::gaussian::Gaussian;
use nalgebra::Vector2;
use rayon::prelude::*;
use sphereflow_core::Plane;
use sphereflow_sphere::Sampler;

/// The image at z + flow(z), bicubic, with its slopes.
pub(super) fn warp(image: &Plane<f32>, flow: &FlowField) -> Warped {
    let (width, height) = image.size();
    let pixels = width * height;
    let mut warped = Warped {
        value: vec![f32::NAN; pixels],
        slope_x: vec![f32::NAN; pixels],
        slope_y: vec![f32::NAN; pixels],
    };
    let sampler = Sampler::new(image);
    warped
        .value
        .par_chunks_mut(width)
        .zip(warped.slope_x.par_chunks_mut(width))
        .zip(warped.slope_y.par_chunks_mut(width))
        .enumerate()
        .for_each(|(y, ((value, slope_x), slope_y))| {
            for x in 0..width {
                let (px, py) = (x as f32 + flow.u[(x, y)], y as f32 + flow.v[(x, y)]);
                let inside =
                    px >= 1.0 && py >= 1.0 && px < width as f32 - 2.0 && py < height as f32 - 2.0;
                if inside {
                    let sample = bicubic(image, px, py);
                    (value[x], slope_x[x], slope_y[x]) = sample;
                } else {
                    let pixel = Vector2::new(f64::from(px), f64::from(py));
                    let sample = sampler.bilinear_with_slope(&pixel);
                    value[x] = sample.value;
                    (slope_x[x], slope_y[x]) = (sample.slope.x, sample.slope.y);
                }
            }
        });
    warped
}

/// Catmull-Rom value and slopes well inside the image: as [`Sampler::bicubic_with_slope`], without
/// the tests at borders.
#[inline]
fn bicubic(image: &Plane<f32>, x: f32, y: f32) -> (f32, f32, f32) {
    let (x0, y0) = (x as usize, y as usize);
    let (s, t) = (x - x0 as f32, y - y0 as f32);
    let (wx, dx) = catmull_rom(s);
    let (wy, dy) = catmull_rom(t);
    let (data, width) = (image.data(), image.width());
    let (mut value, mut by_x, mut by_y) = (0.0, 0.0, 0.0);
    for j in 0..4 {
        let start = (y0 + j - 1) * width + x0 - 1;
        let row = &data[start..start + 4];
        let mix = row[0] * wx[0] + row[1] * wx[1] + row[2] * wx[2] + row[3] * wx[3];
        let slope = row[0] * dx[0] + row[1] * dx[1] + row[2] * dx[2] + row[3] * dx[3];
        value += wy[j] * mix;
        by_x += wy[j] * slope;
        by_y += dy[j] * mix;
    }
    (value, by_x, by_y)
}

#[inline]
fn catmull_rom(t: f32) -> ([f32; 4], [f32; 4]) {
    let (t2, t3) = (t * t, t * t * t);
    (
        [
            0.5 * (2.0 * t2 - t3 - t),
            0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
            0.5 * (4.0 * t2 - 3.0 * t3 + t),
            0.5 * (t3 - t2),
        ],
        [
            0.5 * (4.0 * t - 3.0 * t2 - 1.0),
            0.5 * (9.0 * t2 - 10.0 * t),
            0.5 * (8.0 * t - 9.0 * t2 + 1.0),
            0.5 * (3.0 * t2 - 2.0 * t),
        ],
    )
}

/// The image smoothed by a Gaussian.
pub(super) fn smoothed(image: &Plane<f32>, sigma_px: f32) -> Plane<f32> {
    let mut out = image.clone();
    Gaussian::new(sigma_px).apply(image, &mut out);
    out
}

/// Half the size, every pixel the mean of four.
pub(super) fn halved(image: &Plane<f32>) -> Plane<f32> {
    Plane::from_fn(image.width() / 2, image.height() / 2, |x, y| {
        let (top, bottom) = (image.row(2 * y), image.row(2 * y + 1));
        0.25 * (top[2 * x] + top[2 * x + 1] + bottom[2 * x] + bottom[2 * x + 1])
    })
}

/// The median of each displacement over a square of `2 radius + 1` pixels, cut at the border.
pub(super) fn median_filtered(flow: FlowField, radius: usize) -> FlowField {
    if radius == 0 {
        return flow;
    }
    let filter = |plane: &Plane<f32>| {
        let (width, height) = plane.size();
        let mut out = plane.clone();
        out.data_mut()
            .par_chunks_mut(width)
            .enumerate()
            .for_each(|(y, out)| {
                let rows = y.saturating_sub(radius)..(y + radius + 1).min(height);
                for (x, out) in out.iter_mut().enumerate() {
                    let columns = x.saturating_sub(radius)..(x + radius + 1).min(width);
                    let mut window = [0.0_f32; 25];
                    let mut count = 0;
                    for row in rows.clone() {
                        for value in &plane.row(row)[columns.clone()] {
                            window[count] = *value;
                            count += 1;
                        }
                    }
                    let window = &mut window[..count];
                    window.sort_unstable_by(f32::total_cmp);
                    *out = 0.5 * (window[count / 2] + window[(count - 1) / 2]);
                }
            });
        out
    };
    FlowField {
        u: filter(&flow.u),
        v: filter(&flow.v),
    }
}
