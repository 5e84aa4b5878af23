//! Points out of the normal equations, and back from their solution. Thesis: section 8.4.2.

use super::{Chunk, PointStep};
use crate::bundle::kernel::{inverse_symmetric, subtract, times_symmetric};
use crate::linear::BlockPattern;
use crate::minimise::damping_term;
use crate::options::Damping;
use nalgebra::Vector3;

impl Chunk {
    /// Subtracts the point's part of the Schur complement. Thesis: section 8.4.2.
    #[inline(always)]
    pub(super) fn eliminate_point(
        &mut self,
        point: usize,
        pattern: &BlockPattern,
        damping: Damping,
        lambda: f64,
    ) {
        if !self.free[point] {
            return;
        }
        let mut v = self.v[point];
        for k in [0, 3, 5] {
            v[k] += damping_term(damping, lambda, v[k]);
        }
        let Some(inverse) = inverse_symmetric(&v) else {
            self.singular = true;
            return;
        };
        self.inverse[point] = inverse;
        let g = self.g[point];
        let touches = self.touch_range(point);
        let mut filled = 0;
        for touch in &self.touches[touches.clone()] {
            let (size, w) = (touch.size as usize, &self.w[touch.w()]);
            let y = &mut self.y[filled..filled + 3 * size];
            times_symmetric(y, w, &inverse, size);
            let start = pattern.start(touch.block as usize);
            for (r, rhs) in self.rhs[start..start + size].iter_mut().enumerate() {
                *rhs += y[r] * g.x + y[size + r] * g.y + y[2 * size + r] * g.z;
            }
            filled += 3 * size;
        }
        let mut pair = self.starts[point].pair as usize;
        let mut first = 0;
        for b in touches.clone() {
            let column = self.touches[b];
            let w = &self.w[column.w()];
            let mut at = first;
            for row in &self.touches[b..touches.end] {
                let (rows, columns) = (row.size as usize, column.size as usize);
                let offset = self.pairs[pair] as usize;
                let s = &mut self.reduced[offset..offset + rows * columns];
                subtract(s, &self.y[at..at + 3 * rows], w, rows, columns);
                at += 3 * rows;
                pair += 1;
            }
            first += 3 * column.size as usize;
        }
    }

    /// The points' part of the step, from that of poses and intrinsics.
    pub fn substitute(
        &mut self,
        pattern: &BlockPattern,
        (damping, lambda): (Damping, f64),
        step: &[f64],
    ) {
        self.step = PointStep::default();
        for point in 0..self.points.len() {
            let position = self.current[point];
            self.step.state_squared += position.norm_squared();
            if !self.free[point] {
                self.candidate[point] = position;
                continue;
            }
            let (g, v) = (self.g[point], self.v[point]);
            let mut b = g;
            for touch in &self.touches[self.touch_range(point)] {
                let (size, w) = (touch.size as usize, &self.w[touch.w()]);
                let start = pattern.start(touch.block as usize);
                for (column, sum) in b.iter_mut().enumerate() {
                    let w = &w[column * size..(column + 1) * size];
                    *sum += w
                        .iter()
                        .zip(&step[start..])
                        .map(|(w, d)| w * d)
                        .sum::<f64>();
                }
            }
            let [xx, xy, xz, yy, yz, zz] = self.inverse[point];
            let move_by = -Vector3::new(
                xx * b.x + xy * b.y + xz * b.z,
                xy * b.x + yy * b.y + yz * b.z,
                xz * b.x + yz * b.y + zz * b.z,
            );
            for (axis, k) in [0, 3, 5].into_iter().enumerate() {
                let d = move_by[axis];
                self.step.promised += 0.5 * d * (damping_term(damping, lambda, v[k]) * d - g[axis]);
            }
            self.step.squared += move_by.norm_squared();
            self.candidate[point] = position + move_by;
        }
    }
}
