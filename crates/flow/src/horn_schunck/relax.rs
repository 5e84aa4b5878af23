//! Successive over-relaxation of Horn and Schunck's system, the pixels as on a chessboard.

use super::system::System;
use crate::sweeping::{Blocks, Sweep, sweep_together};
use pulp::Simd;
use sphereflow_raster::{LANES, Padded};
use std::ops::Range;

/// Between 1 (Gauss-Seidel) and 2 (divergence): near the best for means over a few hundred pixels.
const OVER: f32 = 1.9;

/// The factor of each column: the pixels of one colour move, those of the other are read.
const COLOURS: [f32; LANES + 1] = {
    let mut factors = [0.0; LANES + 1];
    let mut column = 0;
    while column <= LANES {
        factors[column] = OVER;
        column += 2;
    }
    factors
};

/// Sweeps after which the largest change is looked at. They run through the image together.
const SWEEPS: usize = 10;

const BLOCKS: Blocks = Blocks {
    together: 2 * SWEEPS,
    columns: 1024,
};

impl System<'_> {
    /// Sweeps in place until no displacement changes by more than the tolerance.
    pub fn relax(&self, flow: &mut [Padded<&mut [f32]>; 2], tolerance_px: f32, sweeps: usize) {
        let mut done = 0;
        while done < sweeps {
            let count = SWEEPS.min(sweeps - done);
            let relaxation = Relaxation {
                system: self,
                flow,
                count,
            };
            let largest = pulp::Arch::new().dispatch(relaxation);
            done += count;
            if largest <= tolerance_px {
                break;
            }
        }
    }
}

/// Sweeps, compiled for wide vectors. Gives the largest change of the last one.
struct Relaxation<'a, 'f> {
    system: &'a System<'a>,
    flow: &'a mut [Padded<&'f mut [f32]>; 2],
    count: usize,
}

impl pulp::WithSimd for Relaxation<'_, '_> {
    type Output = f32;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f32 {
        let (columns, (_, height)) = (self.flow[0].columns(), self.flow[0].size());
        for plane in self.flow.iter_mut() {
            for y in 0..height {
                plane.continue_row(y, [true, true]);
            }
        }
        let halves = 2 * self.count;
        let mut pass = Pass {
            simd,
            system: self.system,
            flow: self.flow,
            last: halves - 2,
            largest: simd.splat_f32s(0.0),
        };
        sweep_together((columns, height), halves, BLOCKS, &mut pass);
        simd.reduce_max_f32s(pass.largest)
    }
}

/// [`Relaxation`] in vectors of one kind.
struct Pass<'a, 'f, S: Simd> {
    simd: S,
    system: &'a System<'a>,
    flow: &'a mut [Padded<&'f mut [f32]>; 2],
    /// First half sweep whose changes count.
    last: usize,
    largest: S::f32s,
}

impl<S: Simd> Sweep for Pass<'_, '_, S> {
    /// Half a sweep: the pixels of one colour.
    #[inline(always)]
    fn visit(&mut self, half: usize, row: usize, columns: Range<usize>) {
        let change = self.piece((half + row) % 2, row, &columns);
        if half >= self.last {
            self.largest = self.simd.max_f32s(self.largest, change);
        }
        let ends = [columns.start == 0, columns.end == self.flow[0].columns()];
        for plane in self.flow.iter_mut() {
            plane.continue_row(row, ends);
        }
    }
}

impl<S: Simd> Pass<'_, '_, S> {
    /// The largest change. What is beyond the last whole vector of the image does not count.
    #[inline(always)]
    fn piece(&mut self, colour: usize, y: usize, columns: &Range<usize>) -> S::f32s {
        let (x, count, simd) = (columns.start, columns.len(), self.simd);
        let (width, height) = self.flow[0].size();
        let whole = width.saturating_sub(x) / S::F32_LANES;
        let coefficients = self.system.coefficients.each_ref();
        let [a, b, c] = coefficients.map(|plane| plane.vectors::<S>(x, y, count, [0, 0]));
        let factors = S::as_simd_f32s(&COLOURS[colour..][..LANES]).0;
        let ratio = simd.splat_f32s(self.system.ratio);
        let shares = self.system.share.map(|share| [share, 0.5 - share]);
        let shares = shares.map(|pair| pair.map(|share| simd.splat_f32s(share)));
        let up = if y == 0 { 0 } else { -1 };
        let down = if y + 1 == height { 0 } else { 1 };
        let mut largest = simd.splat_f32s(0.0);
        for i in 0..count / S::F32_LANES {
            let at = x + i * S::F32_LANES;
            let near = [[-1, 0], [1, 0], [0, up], [0, down], [0, 0]];
            let [u, v] = &*self.flow;
            let u = near.map(|shift| u.vectors::<S>(at, y, S::F32_LANES, shift)[0]);
            let v = near.map(|shift| v.vectors::<S>(at, y, S::F32_LANES, shift)[0]);
            let mean = |[l, r, a, b, _]: [S::f32s; 5], [across, along]: [S::f32s; 2]| {
                let vertical = simd.mul_f32s(along, simd.add_f32s(a, b));
                simd.mul_add_e_f32s(across, simd.add_f32s(l, r), vertical)
            };
            let (mu, mv) = (mean(u, shares[0]), mean(v, shares[1]));
            let r = simd.mul_add_e_f32s(a[i], mu, simd.mul_add_e_f32s(b[i], mv, c[i]));
            let new_u = simd.negate_mul_add_e_f32s(a[i], r, mu);
            let new_v = simd.negate_mul_add_e_f32s(b[i], simd.mul_f32s(r, ratio), mv);
            let factor = factors[i % factors.len()];
            let du = simd.mul_f32s(factor, simd.sub_f32s(new_u, u[4]));
            let dv = simd.mul_f32s(factor, simd.sub_f32s(new_v, v[4]));
            let [out_u, out_v] = &mut *self.flow;
            out_u.vectors_mut::<S>(at, y, S::F32_LANES)[0] = simd.add_f32s(u[4], du);
            out_v.vectors_mut::<S>(at, y, S::F32_LANES)[0] = simd.add_f32s(v[4], dv);
            if i < whole {
                let change = simd.max_f32s(simd.abs_f32s(du), simd.abs_f32s(dv));
                largest = simd.max_f32s(largest, change);
            }
        }
        largest
    }
}
