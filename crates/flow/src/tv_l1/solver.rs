//! The convex problem of one linearisation, solved by a primal-dual iteration.

use super::median::median_filtered;
use crate::FlowField;
use crate::sweeping::{Blocks, Sweep, sweep_together};
use pulp::Simd;
use sphereflow_core::Plane;
use sphereflow_raster::Padded;
use std::ops::Range;

/// Measured at 640x480: what a group of iterations reads and writes stays in the second cache; shorter
/// pieces cost more than they save.
const BLOCKS: Blocks = Blocks {
    together: 20,
    columns: 1024,
};

/// Thesis: section 2.1.4. The residual rho(V) = y1(z + V0) - y0(z) + grad y . (V - V0), affine in V.
#[derive(Clone, Debug)]
pub(super) struct Linearised {
    /// rho at V = 0.
    pub offset: Padded,
    pub slope_x: Padded,
    pub slope_y: Padded,
    /// share / |slope|^2.
    pub per_square: Padded,
}

/// How strongly the data draws: alpha^2 |rho(V)| + beta^2 |V - flow|^2, minimised over V.
///
/// Thesis: eq. (2.9).
#[derive(Clone, Copy, Debug)]
pub(super) struct Weight {
    /// Longest step along grad y, per |grad y|, of the smooth flow.
    reach: f32,
    /// Share of the step that the smooth flow takes; the rest stays between it and V.
    pub share: f32,
}

impl Weight {
    /// From alpha^2 and 1/(2 beta^2).
    pub fn new(lambda: f32, split: f32) -> Self {
        Self {
            reach: lambda * STEP_PRIMAL,
            share: STEP_PRIMAL / (STEP_PRIMAL + split),
        }
    }
}

/// A pixel's part of [`Linearised`], from the warped value with its slopes, the first image's value and
/// slopes, and the flow. Where the flow leads out of the image there is no data: all zero.
#[inline(always)]
pub(super) fn linearise(warped: [f32; 3], own: [f32; 3], flow: [f32; 2], share: f32) -> [f32; 4] {
    // The mean of both slopes is of second order in what is left of the motion.
    let (gx, gy) = (0.5 * (warped[1] + own[1]), 0.5 * (warped[2] + own[2]));
    let offset = warped[0] - own[0] - gx * flow[0] - gy * flow[1];
    if offset.is_finite() {
        [offset, gx, gy, share * per_square(gx, gy)]
    } else {
        [0.0; 4]
    }
}

/// Buffers of a pyramid level: flow, extrapolated flow and dual variables of both components.
#[derive(Clone, Debug)]
pub(super) struct Workspace {
    flow: [Padded; 2],
    ahead: [Padded; 2],
    dual: [[Padded; 2]; 2],
    /// Slopes of the first image by column and row.
    pub slopes: [Plane<f32>; 2],
    pub linear: Linearised,
}

/// Steps of the iteration with tau sigma |grad|^2 = 1: |grad|^2 <= 8 of forward differences.
const STEP_PRIMAL: f32 = 0.25;
const STEP_DUAL: f32 = 0.5;

impl Workspace {
    pub fn new(size: (usize, usize)) -> Self {
        let zero = || Padded::zero(size);
        let pair = || [zero(), zero()];
        Self {
            flow: pair(),
            ahead: pair(),
            dual: [pair(), pair()],
            slopes: [(); 2].map(|()| Plane::filled(size.0, size.1, 0.0)),
            linear: Linearised {
                offset: zero(),
                slope_x: zero(),
                slope_y: zero(),
                per_square: zero(),
            },
        }
    }

    pub fn size(&self) -> (usize, usize) {
        self.ahead[0].size()
    }

    /// Minimises the sum of |grad u| + |grad v| and what `weight` asks of rho(u, v), and filters both by a
    /// median.
    pub fn solve(&mut self, flow: &mut FlowField, weight: Weight, count: usize, radius: usize) {
        for (k, plane) in [&flow.u, &flow.v].into_iter().enumerate() {
            for y in 0..plane.height() {
                for padded in [&mut self.flow[k], &mut self.ahead[k]] {
                    padded.row_mut(y).copy_from_slice(plane.row(y));
                    padded.continue_row(y, [false, true]);
                }
            }
        }
        pulp::Arch::new().dispatch(Iterations {
            work: self,
            weight,
            count,
        });
        for (padded, plane) in self.flow.iter().zip([&mut flow.u, &mut flow.v]) {
            median_filtered(padded, radius, plane);
        }
    }
}

/// Iterations, compiled for wide vectors.
struct Iterations<'a> {
    work: &'a mut Workspace,
    weight: Weight,
    count: usize,
}

impl pulp::WithSimd for Iterations<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let size = (self.work.ahead[0].columns(), self.work.size().1);
        let mut pass = Pass {
            simd,
            work: self.work,
            reach: self.weight.reach,
        };
        sweep_together(size, self.count, BLOCKS, &mut pass);
    }
}

/// [`Iterations`] in vectors of one kind.
///
/// Rims stand for the borders: the flow is continued to the right and downwards, so that the dual variables
/// stay zero where differences would lead out of the image; those to the left and above are zero.
struct Pass<'a, S> {
    simd: S,
    work: &'a mut Workspace,
    reach: f32,
}

impl<S: Simd> Sweep for Pass<'_, S> {
    #[inline(always)]
    fn visit(&mut self, _: usize, row: usize, columns: Range<usize>) {
        for k in 0..2 {
            self.dual_piece(k, row, &columns);
        }
        self.primal_piece(row, &columns);
        if columns.end == self.work.ahead[0].columns() {
            for ahead in &mut self.work.ahead {
                ahead.continue_row(row, [false, true]);
            }
        }
    }
}

impl<S: Simd> Pass<'_, S> {
    /// Ascent of the dual variable along the gradient, and its projection onto the unit disc.
    #[inline(always)]
    fn dual_piece(&mut self, k: usize, y: usize, columns: &Range<usize>) {
        let (x, count, simd) = (columns.start, columns.len(), self.simd);
        let ahead = &self.work.ahead[k];
        let below = if y + 1 == ahead.size().1 { 0 } else { 1 };
        let [own, right, down] = [[0, 0], [1, 0], [0, below]];
        let [own, right, down] =
            [own, right, down].map(|shift| ahead.vectors::<S>(x, y, count, shift));
        let dual = &mut self.work.dual[k];
        let [px, py] = dual
            .each_mut()
            .map(|plane| plane.vectors_mut::<S>(x, y, count));
        let (step, one) = (simd.splat_f32s(STEP_DUAL), simd.splat_f32s(1.0));
        for i in 0..count / S::F32_LANES {
            let a = simd.mul_add_e_f32s(step, simd.sub_f32s(right[i], own[i]), px[i]);
            let b = simd.mul_add_e_f32s(step, simd.sub_f32s(down[i], own[i]), py[i]);
            let square = simd.mul_add_e_f32s(a, a, simd.mul_f32s(b, b));
            let scale = per_root(simd, simd.max_f32s(square, one));
            (px[i], py[i]) = (simd.mul_f32s(a, scale), simd.mul_f32s(b, scale));
        }
    }

    /// Descent of the flow along the divergence, the threshold of the data, and the extrapolation.
    #[inline(always)]
    fn primal_piece(&mut self, y: usize, columns: &Range<usize>) {
        let (x, count, simd) = (columns.start, columns.len(), self.simd);
        let Workspace {
            flow,
            ahead,
            dual,
            linear,
            ..
        } = &mut *self.work;
        let [here, left, above] = [[0, 0], [-1, 0], [0, -1]];
        let [[ux, uy], [vx, vy]] = dual;
        let [ul, ux] = [left, here].map(|shift| ux.vectors::<S>(x, y, count, shift));
        let [ua, uy] = [above, here].map(|shift| uy.vectors::<S>(x, y, count, shift));
        let [vl, vx] = [left, here].map(|shift| vx.vectors::<S>(x, y, count, shift));
        let [va, vy] = [above, here].map(|shift| vy.vectors::<S>(x, y, count, shift));
        let data = [
            &linear.offset,
            &linear.slope_x,
            &linear.slope_y,
            &linear.per_square,
        ];
        let [offset, gx, gy, per_square] = data.map(|p| p.vectors::<S>(x, y, count, here));
        let [u, v] = flow.each_mut().map(|p| p.vectors_mut::<S>(x, y, count));
        let [ahead_u, ahead_v] = ahead.each_mut().map(|p| p.vectors_mut::<S>(x, y, count));
        let (step, two) = (simd.splat_f32s(STEP_PRIMAL), simd.splat_f32s(2.0));
        let [back, reach] = [-self.reach, self.reach].map(|reach| simd.splat_f32s(reach));
        let divergence = |own: [S::f32s; 2], l, a| {
            simd.add_f32s(simd.sub_f32s(own[0], l), simd.sub_f32s(own[1], a))
        };
        for i in 0..count / S::F32_LANES {
            let (old_u, old_v) = (u[i], v[i]);
            let mu = simd.mul_add_e_f32s(step, divergence([ux[i], uy[i]], ul[i], ua[i]), old_u);
            let mv = simd.mul_add_e_f32s(step, divergence([vx[i], vy[i]], vl[i], va[i]), old_v);
            let rho = simd.mul_add_e_f32s(gx[i], mu, simd.mul_add_e_f32s(gy[i], mv, offset[i]));
            let along = threshold(simd, rho, per_square[i], [back, reach]);
            let new_u = simd.negate_mul_add_e_f32s(along, gx[i], mu);
            let new_v = simd.negate_mul_add_e_f32s(along, gy[i], mv);
            (u[i], v[i]) = (new_u, new_v);
            ahead_u[i] = simd.sub_f32s(simd.mul_f32s(two, new_u), old_u);
            ahead_v[i] = simd.sub_f32s(simd.mul_f32s(two, new_v), old_v);
        }
    }
}

/// Thesis: eq. (2.9). How far to go against grad y so as to minimise alpha^2 |rho| + beta^2 |step|^2, where
/// the reach is alpha^2/(2 beta^2) either way: all the way to rho = 0 where that is within it.
#[inline(always)]
fn threshold<S: Simd>(
    simd: S,
    rho: S::f32s,
    per_square: S::f32s,
    [back, reach]: [S::f32s; 2],
) -> S::f32s {
    let whole = simd.mul_f32s(rho, per_square);
    simd.max_f32s(simd.min_f32s(whole, reach), back)
}

/// 1/sqrt(square) to 5e-6: half the time of a root and a division.
#[inline(always)]
fn per_root<S: Simd>(simd: S, square: S::f32s) -> S::f32s {
    // The exponent halved, and two steps of Newton's.
    let bits = simd.wrapping_dyn_shr_u32s(simd.transmute_u32s_f32s(square), simd.splat_u32s(1));
    let bits = simd.sub_u32s(simd.splat_u32s(0x5f37_59df), bits);
    let guess = simd.transmute_f32s_u32s(bits);
    let half = simd.mul_f32s(simd.splat_f32s(0.5), square);
    let newton = |guess| {
        let product = simd.mul_f32s(half, guess);
        let factor = simd.negate_mul_add_e_f32s(product, guess, simd.splat_f32s(1.5));
        simd.mul_f32s(guess, factor)
    };
    newton(newton(guess))
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

    /// The step along grad y.
    fn step(rho: f32, per_square: f32, reach: f32) -> f32 {
        -threshold(pulp::Scalar, rho, per_square, [-reach, reach])
    }

    #[test]
    fn threshold_in_its_three_cases_is_that_of_the_thesis() {
        // Thesis: eq. (2.9).
        let (gx, gy, weight) = (3.0_f32, 4.0_f32, 0.1_f32);
        let reach = weight * 25.0;
        assert!((step(-2.0 * reach, per_square(gx, gy), weight) - weight).abs() < 1e-6);
        assert!((step(2.0 * reach, per_square(gx, gy), weight) + weight).abs() < 1e-6);
        let inside = step(0.5 * reach, per_square(gx, gy), weight);
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
            let found = cost(step(rho, per_square(gx, gy), weight));
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
            let found = step(rho, weight.share / g2, weight.reach);
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
            let relative = per_root(pulp::Scalar, square) * square.sqrt() - 1.0;
            assert!(relative.abs() < 6e-6, "{square}: {relative}");
        }
    }
}
