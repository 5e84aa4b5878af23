//! The linear system of Horn and Schunck, and sweeps over it.

use super::{HornSchunckConfig, Weights};
use crate::sweeping::{Blocks, Sweep, sweep_together};
use pulp::Simd;
use sphereflow_raster::Padded;
use std::ops::Range;

/// Measured at 640x480: what a group of sweeps reads and writes stays in the second cache; shorter pieces
/// cost more than they save.
const BLOCKS: Blocks = Blocks {
    together: 25,
    columns: 1024,
};

/// The linear system, ready for sweeps: with `r = a mean(u) + b mean(v) + c` the new flow is
/// `u = mean(u) - a r`, `v = mean(v) - b r n_u/n_v`, with n alpha^2 of (2.6) for each component n_u and n_v.
///
/// a, b, c are yx, yy, yt over the root of `n_u + yx^2 + yy^2 n_u/n_v`.
pub(super) struct System<'a> {
    pub coefficients: [Padded<&'a mut [f32]>; 3],
    /// n_u/n_v.
    pub ratio: f32,
    /// Share of each horizontal neighbour in the means of u and v.
    pub share: [f32; 2],
}

impl<'a> System<'a> {
    /// From derivatives by column, row and time, which `write` puts into slices of row `y`. The coefficients
    /// are written to `coefficients`.
    pub fn new(
        mut coefficients: [Padded<&'a mut [f32]>; 3],
        config: &HornSchunckConfig,
        mut write: impl FnMut(usize, [&mut [f32]; 3]),
    ) -> Self {
        let Weights { u, v } = Weights::new(config.aspect);
        let alpha2 = config.alpha * config.alpha;
        // Weights of the two neighbours each way.
        let [nu, nv] = [u, v].map(|[x, y]| 2.0 * (x + y) * alpha2);
        let ratio = nu / nv;
        let arch = pulp::Arch::new();
        for y in 0..coefficients[0].size().1 {
            let mut rows = coefficients.each_mut().map(|plane| plane.row_mut(y));
            write(y, rows.each_mut().map(|row| &mut **row));
            arch.dispatch(Scale { rows, nu, ratio });
        }
        Self {
            coefficients,
            ratio,
            share: [u, v].map(|[x, y]| 0.5 * x / (x + y)),
        }
    }

    /// The flow after `sweeps` from `flow`; both it and `other`, whose pixels do not matter, are overwritten.
    ///
    /// Thesis: eq. (2.7).
    pub fn jacobi<'f>(
        &self,
        flow: [Padded<&'f mut [f32]>; 2],
        other: [Padded<&'f mut [f32]>; 2],
        sweeps: usize,
    ) -> [Padded<&'f mut [f32]>; 2] {
        let mut pass = Jacobi {
            system: self,
            flows: [flow, other],
            sweeps,
        };
        pulp::Arch::new().dispatch(&mut pass);
        let [even, odd] = pass.flows;
        if sweeps.is_multiple_of(2) { even } else { odd }
    }
}

/// Derivatives to coefficients. Where one is not known all are zero: nothing is said there, and nothing
/// unknown spreads.
struct Scale<'a> {
    rows: [&'a mut [f32]; 3],
    nu: f32,
    ratio: f32,
}

impl pulp::WithSimd for Scale<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let [a, b, c] = self.rows;
        for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
            let known = (*a + *b + *c).is_finite();
            let scale = 1.0 / (self.nu + *a * *a + *b * *b * self.ratio).sqrt();
            *a = if known { *a * scale } else { 0.0 };
            *b = if known { *b * scale } else { 0.0 };
            *c = if known { *c * scale } else { 0.0 };
        }
    }
}

/// Sweeps from one flow to the other in turn, compiled for wide vectors.
struct Jacobi<'a, 'f> {
    system: &'a System<'a>,
    flows: [[Padded<&'f mut [f32]>; 2]; 2],
    sweeps: usize,
}

impl pulp::WithSimd for &mut Jacobi<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        // The other flow's rims come with its rows.
        for flow in &mut self.flows[0] {
            for y in 0..flow.size().1 {
                flow.continue_row(y, [true, true]);
            }
        }
        let plane = &self.flows[0][0];
        let (size, sweeps) = ((plane.columns(), plane.size().1), self.sweeps);
        if self.system.ratio == 1.0 && self.system.share == [0.25; 2] {
            let mut pass = Pass::<S, true> { simd, jacobi: self };
            sweep_together(size, sweeps, BLOCKS, &mut pass);
        } else {
            let mut pass = Pass::<S, false> { simd, jacobi: self };
            sweep_together(size, sweeps, BLOCKS, &mut pass);
        }
    }
}

/// [`Jacobi`] in vectors of one kind; shorter for square pixels.
struct Pass<'a, 'b, 'f, S, const SQUARE: bool> {
    simd: S,
    jacobi: &'a mut Jacobi<'b, 'f>,
}

impl<S: Simd, const SQUARE: bool> Sweep for Pass<'_, '_, '_, S, SQUARE> {
    #[inline(always)]
    fn visit(&mut self, sweep: usize, row: usize, columns: Range<usize>) {
        let [even, odd] = &mut self.jacobi.flows;
        let (from, to) = match sweep % 2 {
            0 => (&*even, odd),
            _ => (&*odd, even),
        };
        jacobi_piece::<S, SQUARE>(self.simd, self.jacobi.system, row, &columns, from, to);
        let ends = [columns.start == 0, columns.end == from[0].columns()];
        for plane in to {
            plane.continue_row(row, ends);
        }
    }
}

#[inline(always)]
fn jacobi_piece<S: Simd, const SQUARE: bool>(
    simd: S,
    system: &System<'_>,
    y: usize,
    columns: &Range<usize>,
    from: &[Padded<&mut [f32]>; 2],
    to: &mut [Padded<&mut [f32]>; 2],
) {
    let (x, count) = (columns.start, columns.len());
    let up = if y == 0 { 0 } else { -1 };
    let down = if y + 1 == from[0].size().1 { 0 } else { 1 };
    let near = [[-1, 0], [1, 0], [0, up], [0, down]];
    let [u, v] = from;
    let [ul, ur, ua, ub] = near.map(|shift| u.vectors::<S>(x, y, count, shift));
    let [vl, vr, va, vb] = near.map(|shift| v.vectors::<S>(x, y, count, shift));
    let coefficients = system.coefficients.each_ref();
    let [a, b, c] = coefficients.map(|plane| plane.vectors::<S>(x, y, count, [0, 0]));
    let [out_u, out_v] = to
        .each_mut()
        .map(|plane| plane.vectors_mut::<S>(x, y, count));
    let quarter = simd.splat_f32s(0.25);
    let shares = system.share.map(|share| simd.splat_f32s(share));
    let others = system.share.map(|share| simd.splat_f32s(0.5 - share));
    let ratio = simd.splat_f32s(system.ratio);
    let mean = |l, r, a, b, k: usize| {
        let (across, along) = (simd.add_f32s(l, r), simd.add_f32s(a, b));
        if SQUARE {
            simd.mul_f32s(quarter, simd.add_f32s(across, along))
        } else {
            simd.mul_add_e_f32s(shares[k], across, simd.mul_f32s(others[k], along))
        }
    };
    for i in 0..count / S::F32_LANES {
        let mu = mean(ul[i], ur[i], ua[i], ub[i], 0);
        let mv = mean(vl[i], vr[i], va[i], vb[i], 1);
        let r = simd.mul_add_e_f32s(a[i], mu, simd.mul_add_e_f32s(b[i], mv, c[i]));
        let rv = if SQUARE { r } else { simd.mul_f32s(r, ratio) };
        out_u[i] = simd.negate_mul_add_e_f32s(a[i], r, mu);
        out_v[i] = simd.negate_mul_add_e_f32s(b[i], rv, mv);
    }
}
