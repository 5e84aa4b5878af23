//! The primal-dual iteration with the sphere's metric.

use crate::{DataTerm, PixelRays};
use sphereflow_core::Plane;

/// The functional in pixels: sum |K Y| + data |F + G Y|, with K = sqrt(solid angle weights) gradient.
///
/// Everything is divided by the root of the middle pixel's solid angle, so that K of a pinhole is
/// near the plain difference.
#[derive(Clone, Debug)]
pub(super) struct Problem {
    /// dsigma times the symmetric root of the inverse metric, [11, 12, 22]; zero without a ray.
    metric: Vec<[f32; 3]>,
    /// Weight of the data.
    pub data: Vec<f32>,
    /// Largest 1/D.
    pub most: f32,
    /// Bound of |K|^2.
    norm2: f32,
    wraps: bool,
}

/// Primal and dual variables.
#[derive(Clone, Debug)]
pub(super) struct State {
    value: Plane<f32>,
    ahead: Plane<f32>,
    pub px: Plane<f32>,
    pub py: Plane<f32>,
}

/// Iterations that run through the image together, each two rows behind the one before.
const TOGETHER: usize = 8;

impl State {
    pub fn new(width: usize, height: usize) -> Self {
        let zero = || Plane::filled(width, height, 0.0);
        Self {
            value: zero(),
            ahead: zero(),
            px: zero(),
            py: zero(),
        }
    }

    pub fn starting_from(mut self, start: &Plane<f32>) -> Self {
        for (to, from) in self.value.data_mut().iter_mut().zip(start.data()) {
            *to = if from.is_finite() { *from } else { 0.0 };
        }
        self.ahead.clone_from(&self.value);
        self
    }

    pub fn value(&self) -> &Plane<f32> {
        &self.value
    }
}

impl Problem {
    pub fn new(rays: &PixelRays, lambda: f32, most: f32) -> Self {
        let (width, height) = rays.size();
        let middle = rays.solid_angle(height / 2 * width + width / 2);
        let middle = if middle.is_finite() { middle } else { 1e-6 };
        let unit = middle.sqrt();
        let mut metric = Vec::with_capacity(rays.len());
        let mut data = Vec::with_capacity(rays.len());
        let mut norm2 = 0.0_f32;
        for i in 0..rays.len() {
            if !rays.is_valid(i) {
                metric.push([0.0; 3]);
                data.push(0.0);
                continue;
            }
            let angle = rays.solid_angle(i);
            let root = symmetric_root(rays.inverse_metric(i)).map(|m| m * angle / unit);
            // Largest eigenvalue squared, times 8 of the plain differences.
            let [a, b, c] = root;
            let half = 0.5 * (a + c) + (0.25 * (a - c) * (a - c) + b * b).sqrt();
            norm2 = norm2.max(8.0 * half * half);
            metric.push(root);
            data.push(lambda * angle / unit);
        }
        Self {
            metric,
            data,
            most,
            norm2,
            wraps: rays.wraps_around(),
        }
    }

    /// Thesis: eq. (2.18), (2.19), (2.20): `count` iterations. The primal step is 1/(2 beta^2), the
    /// dual step 2 beta^2 / |K|^2: the bound is 1/8 for plain differences, not the printed 1/4.
    pub fn iterate(&self, data: &DataTerm, state: &mut State, beta2: f64, count: usize) {
        let height = state.value.height();
        let primal = (0.5 / beta2) as f32;
        let dual = 1.0 / (self.norm2 * primal);
        // Across the seam the first column would be two rows ahead of the last: one at a time then.
        let mut done = 0;
        while done < count {
            let together = TOGETHER.min(count - done);
            for front in 0..height + 2 * (together - 1) {
                for iteration in 0..together {
                    let row = front.checked_sub(2 * iteration);
                    if let Some(row) = row.filter(|row| *row < height) {
                        self.dual_row(row, state, dual);
                        self.primal_row(row, data, state, primal);
                    }
                }
            }
            done += together;
        }
    }

    /// p + step K Y, projected onto the unit disc: steps 1 and 2.
    fn dual_row(&self, y: usize, state: &mut State, step: f32) {
        let (width, height) = state.value.size();
        let range = y * width..(y + 1) * width;
        let (row, next) = (state.ahead.row(y), state.ahead.row((y + 1).min(height - 1)));
        let metric = &self.metric[range.clone()];
        let (px, py) = (
            &mut state.px.data_mut()[range.clone()],
            &mut state.py.data_mut()[range],
        );
        let mut pixel = |x: usize, dx: f32| {
            let [a, b, c] = metric[x];
            let dy = next[x] - row[x];
            let p = px[x] + step * (a * dx + b * dy);
            let q = py[x] + step * (b * dx + c * dy);
            let scale = 1.0 / (p * p + q * q).sqrt().max(1.0);
            (px[x], py[x]) = (p * scale, q * scale);
        };
        for x in 0..width - 1 {
            pixel(x, row[x + 1] - row[x]);
        }
        let beyond = if self.wraps {
            row[0] - row[width - 1]
        } else {
            0.0
        };
        pixel(width - 1, beyond);
    }

    /// Gamma = Lambda - step K^T p, the threshold, and the extrapolation: steps 3 to 5.
    fn primal_row(&self, y: usize, data: &DataTerm, state: &mut State, step: f32) {
        let width = state.value.width();
        for x in 0..width {
            let here = y * width + x;
            let old = state.value.data()[here];
            let gamma = old - step * self.transposed(state, x, y);
            let (f, g) = (data.f.data()[here], data.g.data()[here]);
            let new =
                (gamma + threshold(f + g * gamma, g, step * self.data[here])).clamp(0.0, self.most);
            state.value.data_mut()[here] = new;
            state.ahead.data_mut()[here] = 2.0 * new - old;
        }
    }

    /// K^T p in pixel `(x, y)`: the transpose of the weighted forward differences.
    #[inline]
    pub(super) fn transposed(&self, state: &State, x: usize, y: usize) -> f32 {
        let (width, height) = state.px.size();
        let (px, py) = (state.px.data(), state.py.data());
        let along = |i: usize| self.metric[i][0] * px[i] + self.metric[i][1] * py[i];
        let down = |i: usize| self.metric[i][1] * px[i] + self.metric[i][2] * py[i];
        let here = y * width + x;
        let mut sum = 0.0;
        if x > 0 {
            sum += along(here - 1);
        } else if self.wraps {
            sum += along(here + width - 1);
        }
        if x + 1 < width || self.wraps {
            sum -= along(here);
        }
        if y > 0 {
            sum += down(here - width);
        }
        if y + 1 < height {
            sum -= down(here);
        }
        sum
    }

    /// |K Y| in pixel `(x, y)`.
    #[inline]
    pub(super) fn variation(&self, value: &Plane<f32>, x: usize, y: usize) -> f32 {
        let (width, height) = value.size();
        let own = value[(x, y)];
        let right = match () {
            () if x + 1 < width => value[(x + 1, y)],
            () if self.wraps => value[(0, y)],
            () => own,
        };
        let below = if y + 1 < height {
            value[(x, y + 1)]
        } else {
            own
        };
        let [a, b, c] = self.metric[y * width + x];
        let (dx, dy) = (right - own, below - own);
        (a * dx + b * dy).hypot(b * dx + c * dy)
    }
}

/// Step 4: the step from Gamma that minimises alpha^2 |rho| + beta^2 step^2, with
/// `weight` = alpha^2/(2 beta^2); none where G = 0.
#[inline]
fn threshold(rho: f32, g: f32, weight: f32) -> f32 {
    let reach = weight * g.abs();
    if g == 0.0 {
        0.0
    } else {
        (-rho / g).clamp(-reach, reach)
    }
}

/// The symmetric square root of a positive definite 2x2 matrix [11, 12, 22].
fn symmetric_root([a, b, c]: [f32; 3]) -> [f32; 3] {
    // (M + sqrt(det) I) / sqrt(trace + 2 sqrt(det)), by Cayley and Hamilton.
    let root = (a * c - b * b).max(0.0).sqrt();
    let scale = 1.0 / (a + c + 2.0 * root).sqrt();
    [(a + root) * scale, b * scale, (c + root) * scale]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threshold_solves_the_stationarity_of_the_thesis_in_all_three_cases() {
        // Thesis: eq. (2.19), (2.20): alpha^2 G - 2 beta^2 (Gamma - Lambda) = 0 where rho(Lambda) > 0.
        let (alpha2, beta2, f) = (0.4_f32, 3.0_f32, -2.0_f32);
        for g in [1.5_f32, -2.5] {
            for gamma in [-3.0_f32, 0.9, 1.34, 4.0] {
                let step = threshold(f + g * gamma, g, alpha2 / (2.0 * beta2));
                let rho = f + g * (gamma + step);
                if rho.abs() > 1e-5 {
                    let slope = alpha2 * g * rho.signum() + 2.0 * beta2 * step;
                    assert!(slope.abs() < 1e-5, "{g} {gamma}: {slope}");
                }
                let cost = |s: f32| alpha2 * (f + g * (gamma + s)).abs() + beta2 * s * s;
                let best = (-3000..=3000)
                    .map(|i| cost(i as f32 * 1e-3))
                    .fold(f32::MAX, f32::min);
                assert!(cost(step) <= best + 1e-4);
            }
        }
        assert_eq!(threshold(3.0, 0.0, 1.0), 0.0);
    }

    #[test]
    fn symmetric_root_squared_is_the_matrix() {
        let [a, b, c] = symmetric_root([4.0, 1.0, 3.0]);
        let square = [a * a + b * b, a * b + b * c, b * b + c * c];
        for (found, expected) in square.iter().zip([4.0, 1.0, 3.0]) {
            assert!((found - expected).abs() < 1e-5);
        }
    }
}
