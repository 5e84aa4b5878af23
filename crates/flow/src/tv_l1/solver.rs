//! The convex problem of one linearisation, solved by a primal-dual iteration.

use crate::FlowField;
use sphereflow_core::Plane;

/// Thesis: section 2.1.4. The residual rho(V) = y1(z + V0) - y0(z) + grad y . (V - V0), affine in V.
pub(super) struct Linearised {
    /// rho at V = 0.
    offset: Vec<f32>,
    slope_x: Vec<f32>,
    slope_y: Vec<f32>,
}

/// An image warped by a flow: values and slopes, NaN where the flow leaves the image.
pub(super) struct Warped {
    pub value: Vec<f32>,
    pub slope_x: Vec<f32>,
    pub slope_y: Vec<f32>,
}

impl Linearised {
    /// Where the flow leads out of the image there is no data: slope and residual are zero.
    pub fn new(from: &Plane<f32>, warped: &Warped, flow: &FlowField) -> Self {
        let (own_x, own_y) = crate::derivatives::sobel(from);
        let pixels = from.data().len();
        let mut linear = Self {
            offset: vec![0.0; pixels],
            slope_x: vec![0.0; pixels],
            slope_y: vec![0.0; pixels],
        };
        for i in 0..pixels {
            // The mean of both slopes is of second order in what is left of the motion.
            let gx = 0.5 * (warped.slope_x[i] + own_x.data()[i]);
            let gy = 0.5 * (warped.slope_y[i] + own_y.data()[i]);
            let rest = warped.value[i] - from.data()[i];
            let offset = rest - gx * flow.u.data()[i] - gy * flow.v.data()[i];
            if offset.is_finite() {
                (linear.offset[i], linear.slope_x[i], linear.slope_y[i]) = (offset, gx, gy);
            }
        }
        linear
    }
}

/// Buffers of a pyramid level: extrapolated flow and dual variables of both components.
#[derive(Clone, Debug)]
pub(super) struct Workspace {
    ahead: [Plane<f32>; 2],
    dual: [[Plane<f32>; 2]; 2],
}

/// Steps of the iteration with tau sigma |grad|^2 = 1: |grad|^2 <= 8 of forward differences.
const STEP_PRIMAL: f32 = 0.25;
const STEP_DUAL: f32 = 0.5;

/// Iterations that run through the image together, each two rows behind the one before.
const TOGETHER: usize = 8;

impl Workspace {
    pub fn new((width, height): (usize, usize)) -> Self {
        let zero = || Plane::filled(width, height, 0.0);
        let pair = || [zero(), zero()];
        Self {
            ahead: pair(),
            dual: [pair(), pair()],
        }
    }

    pub fn size(&self) -> (usize, usize) {
        self.ahead[0].size()
    }

    /// Minimises the sum of |grad u| + |grad v| + lambda |rho(u, v)|.
    pub fn solve(&mut self, linear: &Linearised, flow: &mut FlowField, lambda: f32, count: usize) {
        let height = flow.size().1;
        self.ahead[0].clone_from(&flow.u);
        self.ahead[1].clone_from(&flow.v);
        let mut done = 0;
        while done < count {
            let together = TOGETHER.min(count - done);
            for front in 0..height + 2 * (together - 1) {
                for iteration in 0..together {
                    let row = front.checked_sub(2 * iteration);
                    if let Some(row) = row.filter(|row| *row < height) {
                        self.dual_row(row);
                        self.primal_row(row, linear, flow, lambda);
                    }
                }
            }
            done += together;
        }
    }

    /// Ascent of the dual variable along the gradient, and its projection onto the unit disc.
    fn dual_row(&mut self, y: usize) {
        let (width, height) = self.size();
        let below = (y + 1).min(height - 1);
        let range = y * width..(y + 1) * width;
        for (ahead, [px, py]) in self.ahead.iter().zip(&mut self.dual) {
            let (row, next) = (ahead.row(y), ahead.row(below));
            let (px, py) = (
                &mut px.data_mut()[range.clone()],
                &mut py.data_mut()[range.clone()],
            );
            let right = row.iter().zip(&row[1..]).zip(next);
            for ((px, py), ((own, right), below)) in px.iter_mut().zip(py.iter_mut()).zip(right) {
                let a = *px + STEP_DUAL * (right - own);
                let b = *py + STEP_DUAL * (below - own);
                let scale = 1.0 / (a * a + b * b).sqrt().max(1.0);
                (*px, *py) = (a * scale, b * scale);
            }
            let last = width - 1;
            px[last] = 0.0;
            py[last] = (py[last] + STEP_DUAL * (next[last] - row[last])).clamp(-1.0, 1.0);
        }
    }

    /// Descent of the flow along the divergence, the threshold of the data, and the extrapolation.
    fn primal_row(&mut self, y: usize, linear: &Linearised, flow: &mut FlowField, lambda: f32) {
        let (width, height) = self.size();
        let range = y * width..(y + 1) * width;
        let [[pux, puy], [pvx, pvy]] = &self.dual;
        let above = y.saturating_sub(1);
        // Rows of the vertical dual, of which the first has nothing above and the last does not count.
        let (own, before) = (
            if y + 1 < height { 1.0 } else { 0.0 },
            if y > 0 { 1.0 } else { 0.0 },
        );
        let (ux, uy, uy_above) = (pux.row(y), puy.row(y), puy.row(above));
        let (vx, vy, vy_above) = (pvx.row(y), pvy.row(y), pvy.row(above));
        let [ahead_u, ahead_v] = &mut self.ahead;
        let (ahead_u, ahead_v) = (
            &mut ahead_u.data_mut()[range.clone()],
            &mut ahead_v.data_mut()[range.clone()],
        );
        let (u, v) = (
            &mut flow.u.data_mut()[range.clone()],
            &mut flow.v.data_mut()[range.clone()],
        );
        let (gx, gy) = (
            &linear.slope_x[range.clone()],
            &linear.slope_y[range.clone()],
        );
        let offset = &linear.offset[range];
        let weight = STEP_PRIMAL * lambda;
        let mut pixel = |x: usize, ux_left: f32, vx_left: f32| {
            let div_u = ux[x] - ux_left + own * uy[x] - before * uy_above[x];
            let div_v = vx[x] - vx_left + own * vy[x] - before * vy_above[x];
            let (mu, mv) = (u[x] + STEP_PRIMAL * div_u, v[x] + STEP_PRIMAL * div_v);
            let step = threshold(offset[x] + gx[x] * mu + gy[x] * mv, gx[x], gy[x], weight);
            let (nu, nv) = (mu + step * gx[x], mv + step * gy[x]);
            (ahead_u[x], ahead_v[x]) = (2.0 * nu - u[x], 2.0 * nv - v[x]);
            (u[x], v[x]) = (nu, nv);
        };
        pixel(0, 0.0, 0.0);
        for x in 1..width {
            pixel(x, ux[x - 1], vx[x - 1]);
        }
    }
}

/// Thesis: eq. (2.9). The step along grad y that minimises alpha^2 |rho| + beta^2 |step|^2, where
/// `weight` = alpha^2/(2 beta^2): full towards rho = 0 where that is in reach.
#[inline]
fn threshold(rho: f32, gx: f32, gy: f32, weight: f32) -> f32 {
    /// Keeps the quotient finite where there is no slope; nothing is reached there anyway.
    const NO_SLOPE: f32 = 1e-9;
    (-rho / (gx * gx + gy * gy + NO_SLOPE)).clamp(-weight, weight)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threshold_in_its_three_cases_is_that_of_the_thesis() {
        // Thesis: eq. (2.9).
        let (gx, gy, weight) = (3.0_f32, 4.0_f32, 0.1_f32);
        let reach = weight * 25.0;
        assert!((threshold(-2.0 * reach, gx, gy, weight) - weight).abs() < 1e-6);
        assert!((threshold(2.0 * reach, gx, gy, weight) + weight).abs() < 1e-6);
        let inside = threshold(0.5 * reach, gx, gy, weight);
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
            let found = cost(threshold(rho, gx, gy, weight));
            let best = (-1000..=1000)
                .map(|i| cost(i as f32 * 1e-3))
                .fold(f32::MAX, f32::min);
            assert!(found <= best + 1e-5, "{rho}: {found} {best}");
        }
    }
}
