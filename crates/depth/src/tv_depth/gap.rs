//! How far a solution is from the best: energy and duality gap.

use super::solver::{Problem, State};
use crate::DataTerm;

impl Problem {
    /// The functional at the primal variable.
    ///
    /// Thesis: eq. (2.17), divided by the root of the middle pixel's solid angle.
    pub fn energy(&self, data: &DataTerm, state: &State) -> f64 {
        let (width, height) = state.px.size();
        let value = state.value();
        let mut sum = 0.0;
        for y in 0..height {
            for x in 0..width {
                let i = y * width + x;
                let rho = data.f.data()[i] + data.g.data()[i] * value.data()[i];
                sum += f64::from(self.variation(value, x, y) + self.data[i] * rho.abs());
            }
        }
        sum
    }

    /// Energy minus the dual's bound from below, over the energy. With 1/D between 0 and its largest
    /// value the bound is finite for every dual variable: in each pixel the least of
    /// `s Y + w |F + G Y|` lies at an end or at the kink.
    pub fn relative_gap(&self, data: &DataTerm, state: &State) -> f64 {
        let (width, height) = state.px.size();
        let mut bound = 0.0;
        for y in 0..height {
            for x in 0..width {
                let i = y * width + x;
                let slope = self.transposed(state, x, y);
                let (f, g, w) = (data.f.data()[i], data.g.data()[i], self.data[i]);
                let cost = |value: f32| slope * value + w * (f + g * value).abs();
                let kink = if g == 0.0 {
                    0.0
                } else {
                    (-f / g).clamp(0.0, self.most)
                };
                bound += f64::from(cost(0.0).min(cost(self.most)).min(cost(kink)));
            }
        }
        let energy = self.energy(data, state);
        (energy - bound) / energy.max(f64::MIN_POSITIVE)
    }
}
