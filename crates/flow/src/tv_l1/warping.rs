//! What goes on between the linearisations: warped images, smaller images, median filters.

use super::bicubic::{Bicubic, TOGETHER};
use super::solver::{Weight, Workspace, linearise};
use crate::FlowField;
use nalgebra::Vector2;
use rayon::prelude::*;
use sphereflow_core::Plane;
use sphereflow_raster::{Gaussian, Padded};
use sphereflow_sphere::Sampler;

/// The data at z + flow(z) into `work`: `to` read bicubically with its slopes, against `from`.
pub(super) fn linearise_at(
    work: &mut Workspace,
    from: &Plane<f32>,
    to: &Plane<f32>,
    flow: &FlowField,
    weight: Weight,
) {
    let linear = &mut work.linear;
    let [own_x, own_y] = &work.slopes;
    let arch = pulp::Arch::new();
    let rows = linear.offset.rows_mut().zip(linear.slope_x.rows_mut());
    let others = linear.slope_y.rows_mut().zip(linear.per_square.rows_mut());
    rows.zip(others)
        .enumerate()
        .for_each(|(y, ((offset, gx), (gy, per_square)))| {
            let own = [from.row(y), own_x.row(y), own_y.row(y)];
            let flow = [flow.u.row(y), flow.v.row(y)];
            let out = [offset, gx, gy, per_square];
            let out = out.map(|row| &mut row[Padded::PIXELS..][..from.width()]);
            arch.dispatch(LineariseRow {
                to,
                y,
                own,
                flow,
                share: weight.share,
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
    share: f32,
    out: [&'a mut [f32]; 4],
}

impl pulp::WithSimd for LineariseRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        linearise_row(self.to, self.y, self.own, self.flow, self.share, self.out);
    }
}

#[inline(always)]
fn linearise_row(
    to: &Plane<f32>,
    y: usize,
    own: [&[f32]; 3],
    flow: [&[f32]; 2],
    share: f32,
    out: [&mut [f32]; 4],
) {
    let width = to.width();
    let mut warped = Bicubic::new();
    let [offset, slope_x, slope_y, per_square] = out;
    for first in (0..width).step_by(TOGETHER) {
        let count = TOGETHER.min(width - first);
        let piece = first..first + count;
        let flow = flow.map(|row| &row[piece.clone()]);
        warped.read(to, y, first, flow);
        at_border(&mut warped, to, (first, y), flow);
        let own = own.map(|row| &row[piece.clone()]);
        let offset = &mut offset[piece.clone()];
        let (slope_x, slope_y) = (&mut slope_x[piece.clone()], &mut slope_y[piece.clone()]);
        let per_square = &mut per_square[piece];
        let [value, warped_x, warped_y] = &warped.found;
        let (value, warped_x) = (&value[..count], &warped_x[..count]);
        let warped_y = &warped_y[..count];
        for i in 0..count {
            let warped = [value[i], warped_x[i], warped_y[i]];
            let own = [own[0][i], own[1][i], own[2][i]];
            let new = linearise(warped, own, [flow[0][i], flow[1][i]], share);
            [offset[i], slope_x[i], slope_y[i], per_square[i]] = new;
        }
    }
}

/// Where the sixteen pixels around a place are not there, four do; outside there is nothing (NaN).
#[inline(always)]
fn at_border(warped: &mut Bicubic, to: &Plane<f32>, (first, y): (usize, usize), flow: [&[f32]; 2]) {
    let count = flow[0].len();
    if warped.inside[..count].iter().all(|inside| *inside) {
        return;
    }
    let sampler = Sampler::new(to);
    for i in (0..count).filter(|i| !warped.inside[*i]) {
        let (px, py) = ((first + i) as f32 + flow[0][i], y as f32 + flow[1][i]);
        let sample = sampler.bilinear_with_slope(&Vector2::new(f64::from(px), f64::from(py)));
        let found = [sample.value, sample.slope.x, sample.slope.y];
        for (out, found) in warped.found.iter_mut().zip(found) {
            out[i] = found;
        }
    }
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
