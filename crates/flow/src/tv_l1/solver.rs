//! The convex problem of one linearisation, solved by a primal-dual iteration.

use super::median::median_filtered;
use crate::FlowField;
use crate::sweeping::{Sweep, sweep_together};
use sphereflow_core::Plane;
use std::ops::Range;

/// Thesis: section 2.1.4. The residual rho(V) = y1(z + V0) - y0(z) + grad y . (V - V0), affine in V.
#[derive(Clone, Debug, Default)]
pub(super) struct Linearised {
    /// rho at V = 0.
    pub offset: Vec<f32>,
    pub slope_x: Vec<f32>,
    pub slope_y: Vec<f32>,
    /// 1 / |slope|^2.
    pub per_square: Vec<f32>,
}

/// How strongly the data draws: alpha^2 |rho(V)| + beta^2 |V - flow|^2, minimised over V.
///
/// Thesis: eq. (2.9).
#[derive(Clone, Copy, Debug)]
pub(super) struct Weight {
    /// Longest step along grad y, per |grad y|.
    reach: f32,
    /// Share of the step that the smooth flow takes; the rest stays between it and V.
    share: f32,
}

impl Weight {
    /// From alpha^2 and 1/(2 beta^2).
    pub fn new(lambda: f32, split: f32) -> Self {
        Self {
            reach: lambda * (STEP_PRIMAL + split),
            share: STEP_PRIMAL / (STEP_PRIMAL + split),
        }
    }
}

impl Linearised {
    /// Room for a level's pixels.
    pub fn resize(&mut self, pixels: usize) {
        for plane in [
            &mut self.offset,
            &mut self.slope_x,
            &mut self.slope_y,
            &mut self.per_square,
        ] {
            plane.resize(pixels, 0.0);
        }
    }
}

/// A pixel's part of [`Linearised`], from the warped value with its slopes, the first image's value and
/// slopes, and the flow. Where the flow leads out of the image there is no data: all zero.
#[inline(always)]
pub(super) fn linearise(warped: [f32; 3], own: [f32; 3], flow: [f32; 2]) -> [f32; 4] {
    // The mean of both slopes is of second order in what is left of the motion.
    let (gx, gy) = (0.5 * (warped[1] + own[1]), 0.5 * (warped[2] + own[2]));
    let offset = warped[0] - own[0] - gx * flow[0] - gy * flow[1];
    if offset.is_finite() {
        [offset, gx, gy, per_square(gx, gy)]
    } else {
        [0.0; 4]
    }
}

/// Buffers of a pyramid level: extrapolated flow and dual variables of both components.
#[derive(Clone, Debug)]
pub(super) struct Workspace {
    ahead: [Plane<f32>; 2],
    dual: [[Plane<f32>; 2]; 2],
    /// Slopes of the first image by column and row.
    pub slopes: [Plane<f32>; 2],
    pub linear: Linearised,
}

/// Steps of the iteration with tau sigma |grad|^2 = 1: |grad|^2 <= 8 of forward differences.
const STEP_PRIMAL: f32 = 0.25;
const STEP_DUAL: f32 = 0.5;

impl Workspace {
    pub fn new((width, height): (usize, usize)) -> Self {
        let zero = || Plane::filled(width, height, 0.0);
        let pair = || [zero(), zero()];
        Self {
            ahead: pair(),
            dual: [pair(), pair()],
            slopes: pair(),
            linear: Linearised::default(),
        }
    }

    pub fn size(&self) -> (usize, usize) {
        self.ahead[0].size()
    }

    /// Minimises the sum of |grad u| + |grad v| and what `weight` asks of rho(u, v).
    pub fn solve(&mut self, flow: &mut FlowField, weight: Weight, count: usize) {
        self.ahead[0].clone_from(&flow.u);
        self.ahead[1].clone_from(&flow.v);
        let linear = std::mem::take(&mut self.linear);
        pulp::Arch::new().dispatch(Iterations {
            work: self,
            linear: &linear,
            flow,
            weight,
            count,
        });
        self.linear = linear;
    }

    /// The median filter of both displacements.
    pub fn clean(&mut self, flow: &mut FlowField, radius: usize) {
        if radius == 0 {
            return;
        }
        for (plane, buffer) in [&mut flow.u, &mut flow.v].into_iter().zip(&mut self.ahead) {
            median_filtered(plane, radius, buffer);
            std::mem::swap(plane, buffer);
        }
    }

    /// Ascent of the dual variable along the gradient, and its projection onto the unit disc.
    #[inline(always)]
    fn dual_row(&mut self, y: usize, columns: Range<usize>) {
        let (width, height) = self.size();
        let below = (y + 1).min(height - 1);
        let (last, first) = (width - 1, columns.start);
        // Slices of one length have no bounds to check, so that the loops run on vectors.
        let count = columns.end.min(last).saturating_sub(first);
        for (ahead, [px, py]) in self.ahead.iter().zip(&mut self.dual) {
            let (row, next) = (ahead.row(y), ahead.row(below));
            let px = &mut px.data_mut()[y * width..(y + 1) * width];
            let py = &mut py.data_mut()[y * width..(y + 1) * width];
            if columns.end == width {
                px[last] = 0.0;
                py[last] = (py[last] + STEP_DUAL * (next[last] - row[last])).clamp(-1.0, 1.0);
            }
            let (own, right) = (&row[first..][..count], &row[first + 1..][..count]);
            let down = &next[first..][..count];
            let (px, py) = (&mut px[first..][..count], &mut py[first..][..count]);
            for i in 0..count {
                let a = px[i] + STEP_DUAL * (right[i] - own[i]);
                let b = py[i] + STEP_DUAL * (down[i] - own[i]);
                let square = a * a + b * b;
                let scale = per_root(if square > 1.0 { square } else { 1.0 });
                (px[i], py[i]) = (a * scale, b * scale);
            }
        }
    }

    /// Descent of the flow along the divergence, the threshold of the data, and the extrapolation.
    #[inline(always)]
    fn primal_row(
        &mut self,
        y: usize,
        columns: Range<usize>,
        linear: &Linearised,
        flow: &mut FlowField,
        weight: Weight,
    ) {
        let (width, height) = self.size();
        let range = y * width..(y + 1) * width;
        let above = y.saturating_sub(1);
        // Rows of the vertical dual, of which the first has nothing above and the last does not count.
        let own = if y + 1 < height { 1.0 } else { 0.0 };
        let before = if y > 0 { 1.0 } else { 0.0 };
        let [[ux, uy], [vx, vy]] = &self.dual;
        let duals = [
            [ux.row(y), uy.row(y), uy.row(above)],
            [vx.row(y), vy.row(y), vy.row(above)],
        ];
        let [ahead_u, ahead_v] = &mut self.ahead;
        let mut out = [
            &mut flow.u.data_mut()[range.clone()],
            &mut flow.v.data_mut()[range.clone()],
            &mut ahead_u.data_mut()[range.clone()],
            &mut ahead_v.data_mut()[range.clone()],
        ];
        let data = [
            &linear.offset,
            &linear.slope_x,
            &linear.slope_y,
            &linear.per_square,
        ]
        .map(|plane| &plane[range.clone()]);
        let pixel = |flow: [f32; 2], div: [f32; 2], data: [f32; 4]| primal(flow, div, data, weight);
        if columns.start == 0 {
            let div = duals.map(|[x, y, above]| x[0] + own * y[0] - before * above[0]);
            let new = pixel([out[0][0], out[1][0]], div, data.map(|d| d[0]));
            out.iter_mut().zip(new).for_each(|(out, new)| out[0] = new);
        }
        let first = columns.start.max(1);
        let count = columns.end - first;
        let [[ux, uy, ua], [vx, vy, va]] = duals;
        let (ul, vl) = (&ux[first - 1..][..count], &vx[first - 1..][..count]);
        let [ux, uy, ua] = [ux, uy, ua].map(|row| &row[first..][..count]);
        let [vx, vy, va] = [vx, vy, va].map(|row| &row[first..][..count]);
        let [offset, gx, gy, per_square] = data.map(|row| &row[first..][..count]);
        let [u, v, ahead_u, ahead_v] = out.map(|row| &mut row[first..][..count]);
        for i in 0..count {
            let div_u = ux[i] - ul[i] + own * uy[i] - before * ua[i];
            let div_v = vx[i] - vl[i] + own * vy[i] - before * va[i];
            let data = [offset[i], gx[i], gy[i], per_square[i]];
            let new = pixel([u[i], v[i]], [div_u, div_v], data);
            [u[i], v[i], ahead_u[i], ahead_v[i]] = new;
        }
    }
}

/// Iterations, compiled for wide vectors.
struct Iterations<'a> {
    work: &'a mut Workspace,
    linear: &'a Linearised,
    flow: &'a mut FlowField,
    weight: Weight,
    count: usize,
}

impl pulp::WithSimd for Iterations<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(mut self, _: S) {
        sweep_together(self.flow.size(), self.count, &mut self);
    }
}

impl Sweep for Iterations<'_> {
    #[inline(always)]
    fn visit(&mut self, _: usize, row: usize, columns: Range<usize>) {
        self.work.dual_row(row, columns.clone());
        self.work
            .primal_row(row, columns, self.linear, self.flow, self.weight);
    }
}

/// The new flow of a pixel and its extrapolation, from flow, divergence and data (offset, slopes, 1/slope^2).
#[inline(always)]
fn primal(flow: [f32; 2], div: [f32; 2], data: [f32; 4], weight: Weight) -> [f32; 4] {
    let [offset, gx, gy, per_square] = data;
    let (mu, mv) = (
        flow[0] + STEP_PRIMAL * div[0],
        flow[1] + STEP_PRIMAL * div[1],
    );
    let step = weight.share * threshold(offset + gx * mu + gy * mv, per_square, weight.reach);
    let (u, v) = (mu + step * gx, mv + step * gy);
    [u, v, 2.0 * u - flow[0], 2.0 * v - flow[1]]
}

/// 1/sqrt(square) to 5e-6: half the time of a root and a division.
#[inline(always)]
fn per_root(square: f32) -> f32 {
    // The exponent halved, and two steps of Newton's.
    let guess = f32::from_bits(0x5f37_59df - (square.to_bits() >> 1));
    let half = 0.5 * square;
    let guess = guess * (1.5 - half * guess * guess);
    guess * (1.5 - half * guess * guess)
}

/// Thesis: eq. (2.9). The step along grad y that minimises alpha^2 |rho| + beta^2 |step|^2, where
/// `weight` = alpha^2/(2 beta^2): full towards rho = 0 where that is in reach.
#[inline(always)]
fn threshold(rho: f32, per_square: f32, weight: f32) -> f32 {
    let step = -rho * per_square;
    let step = if step > weight { weight } else { step };
    if step < -weight { -weight } else { step }
}

/// 1/(gx^2 + gy^2), finite where there is no slope: nothing is reached there anyway.
#[inline(always)]
fn per_square(gx: f32, gy: f32) -> f32 {
    const NO_SLOPE: f32 = 1e-9;
    1.0 / (gx * gx + gy * gy + NO_SLOPE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threshold_in_its_three_cases_is_that_of_the_thesis() {
        // Thesis: eq. (2.9).
        let (gx, gy, weight) = (3.0_f32, 4.0_f32, 0.1_f32);
        let reach = weight * 25.0;
        assert!((threshold(-2.0 * reach, per_square(gx, gy), weight) - weight).abs() < 1e-6);
        assert!((threshold(2.0 * reach, per_square(gx, gy), weight) + weight).abs() < 1e-6);
        let inside = threshold(0.5 * reach, per_square(gx, gy), weight);
        assert!(
            (0.5 * reach + inside * 25.0).abs() < 1e-5,
            "rho must vanish"
        );
    }

    #[test]
    fn threshold_is_the_minimiser_of_its_cost() {
        // Thesis: eq. (2.9), against a fine search of alpha^2 |rho| + beta^2 |step|^2.
        let (gx, gy, weight) = (0.8_f32, -0.3_f32, 0.4_f32);
        for rho in [-2.0_f32, -0.2, 0.0, 0.1, 3.0] {
            let g2 = gx * gx + gy * gy;
            let cost = |s: f32| 2.0 * weight * (rho + s * g2).abs() + s * s * g2;
            let found = cost(threshold(rho, per_square(gx, gy), weight));
            let best = (-1000..=1000)
                .map(|i| cost(i as f32 * 1e-3))
                .fold(f32::MAX, f32::min);
            assert!(found <= best + 1e-5, "{rho}: {found} {best}");
        }
    }
    #[test]
    fn weight_with_a_split_gives_the_minimiser_over_both_flows() {
        // Thesis: eq. (2.9): a fine search of (s - 0)^2 g2/(2 tau) + alpha^2 |rho + V g2| + (V - s)^2 g2/(2 split).
        let (lambda, split, g2) = (0.3_f32, 0.2_f32, 0.7_f32);
        let weight = Weight::new(lambda, split);
        for rho in [-2.0_f32, -0.1, 0.02, 0.3] {
            let found = weight.share * threshold(rho, 1.0 / g2, weight.reach);
            let (mut best, mut least) = (0.0, f32::MAX);
            for s in (-300..=300).map(|i| i as f32 * 1e-3) {
                for v in (-600..=600).map(|i| i as f32 * 1e-3) {
                    let cost = 0.5 * s * s * g2 / STEP_PRIMAL
                        + lambda * (rho + v * g2).abs()
                        + 0.5 * (v - s) * (v - s) * g2 / split;
                    if cost < least {
                        (best, least) = (s, cost);
                    }
                }
            }
            // Of the search's grid.
            assert!((found - best).abs() < 5e-3, "{rho}: {found} {best}");
        }
    }

    #[test]
    fn per_root_is_one_over_the_root() {
        for square in [1.0_f32, 1.7, 3.0, 100.0, 12_345.0] {
            let relative = per_root(square) * square.sqrt() - 1.0;
            assert!(relative.abs() < 6e-6, "{square}: {relative}");
        }
    }
}
