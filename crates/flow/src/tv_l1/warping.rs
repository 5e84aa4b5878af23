//! What goes on between the linearisations: warped images, smaller images, median filters.

use super::solver::{Workspace, linearise};
use crate::FlowField;
use crate::gaussian::Gaussian;
use nalgebra::Vector2;
use rayon::prelude::*;
use sphereflow_core::Plane;
use sphereflow_sphere::Sampler;

/// The data at z + flow(z) into `work`: `to` read bicubically with its slopes, against `from`.
pub(super) fn linearise_at(
    work: &mut Workspace,
    from: &Plane<f32>,
    to: &Plane<f32>,
    flow: &FlowField,
) {
    let width = from.width();
    let linear = &mut work.linear;
    linear.resize(from.data().len());
    let [own_x, own_y] = &work.slopes;
    let arch = pulp::Arch::new();
    let rows = linear.offset.par_chunks_mut(width);
    let rows = rows.zip(linear.slope_x.par_chunks_mut(width));
    let rows = rows.zip(linear.slope_y.par_chunks_mut(width));
    let rows = rows.zip(linear.per_square.par_chunks_mut(width));
    rows.enumerate()
        .for_each(|(y, (((offset, gx), gy), per_square))| {
            let own = [from.row(y), own_x.row(y), own_y.row(y)];
            let flow = [flow.u.row(y), flow.v.row(y)];
            let out = [offset, gx, gy, per_square];
            arch.dispatch(LineariseRow {
                to,
                y,
                own,
                flow,
                out,
            });
        });
}

/// [`linearise_row`], compiled for wide vectors.
struct LineariseRow<'a> {
    to: &'a Plane<f32>,
    y: usize,
    own: [&'a [f32]; 3],
    flow: [&'a [f32]; 2],
    out: [&'a mut [f32]; 4],
}

impl pulp::WithSimd for LineariseRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        linearise_row(self.to, self.y, self.own, self.flow, self.out);
    }
}

#[inline(always)]
fn linearise_row(
    to: &Plane<f32>,
    y: usize,
    own: [&[f32]; 3],
    flow: [&[f32]; 2],
    out: [&mut [f32]; 4],
) {
    let (width, height) = to.size();
    let (last_x, last_y) = (width as f32 - 2.0, height as f32 - 2.0);
    let sampler = Sampler::new(to);
    for x in 0..width {
        let flow = flow.map(|row| row[x]);
        let (px, py) = (x as f32 + flow[0], y as f32 + flow[1]);
        let inside = px >= 1.0 && py >= 1.0 && px < last_x && py < last_y;
        let warped = if inside {
            bicubic(to, px, py)
        } else {
            let pixel = Vector2::new(f64::from(px), f64::from(py));
            let sample = sampler.bilinear_with_slope(&pixel);
            [sample.value, sample.slope.x, sample.slope.y]
        };
        let new = linearise(warped, own.map(|row| row[x]), flow);
        for k in 0..4 {
            out[k][x] = new[k];
        }
    }
}

/// Catmull-Rom value and slopes well inside the image: as [`Sampler::bicubic_with_slope`], without
/// the tests at borders.
#[inline(always)]
fn bicubic(image: &Plane<f32>, x: f32, y: f32) -> [f32; 3] {
    let (x0, y0) = (x as usize, y as usize);
    let (s, t) = (x - x0 as f32, y - y0 as f32);
    let (wx, dx) = catmull_rom(s);
    let (wy, dy) = catmull_rom(t);
    let (data, width) = (image.data(), image.width());
    // Down the columns first, four of them at a time.
    let (mut mixed, mut slope) = ([0.0_f32; 4], [0.0_f32; 4]);
    for j in 0..4 {
        let start = (y0 + j - 1) * width + x0 - 1;
        let row = &data[start..start + 4];
        for i in 0..4 {
            mixed[i] += wy[j] * row[i];
            slope[i] += dy[j] * row[i];
        }
    }
    let along =
        |w: &[f32; 4], v: &[f32; 4]| w[0] * v[0] + w[1] * v[1] + (w[2] * v[2] + w[3] * v[3]);
    [along(&wx, &mixed), along(&dx, &mixed), along(&wx, &slope)]
}

#[inline(always)]
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
