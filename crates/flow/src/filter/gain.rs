//! How much brighter the new image is than a past one, measured between warped images.

use super::lattice::{LensCall, mix};
use super::lens::Lens;
use super::state::Node;
use super::update::Pair;
use rayon::prelude::*;

/// Measures the gain of each row of the new image.
pub(super) struct MeasureGain<'a, 'b> {
    pub pair: &'a Pair<'b>,
    pub nodes: &'a [Node],
    /// Rows on their own, where they say so clearly; else one gain for the image.
    pub rows: bool,
}

/// Sums over the pixels of a row that both images see.
#[derive(Clone, Copy, Default)]
struct Sums {
    new: f64,
    past: f64,
    count: f64,
}

impl LensCall<Vec<f32>> for MeasureGain<'_, '_> {
    fn call<L: Lens>(self, lens: &L) -> Vec<f32> {
        /// Every so many pixels of a row are enough.
        const STEP: usize = 3;
        let (lattice, pair) = (self.pair.lattice, self.pair);
        let sums: Vec<Sums> = (0..lattice.height)
            .into_par_iter()
            .map(|y| {
                let mut sums = Sums::default();
                for x in (y % STEP..lattice.width).step_by(STEP) {
                    let here = y * lattice.width + x;
                    let zeta = self.nodes[here][0];
                    let there =
                        pair.step.rotation * lattice.ray[here] + pair.step.translation * zeta;
                    let place = lens.project(&there);
                    let Some((four, s, t)) = lattice.around(place) else {
                        continue;
                    };
                    let (past, new) = (
                        mix(&pair.past.pixel, four, s, t)[0],
                        pair.new.pixel[here][0],
                    );
                    if past.is_finite() && new.is_finite() {
                        sums.new += f64::from(new);
                        sums.past += f64::from(past);
                        sums.count += 1.0;
                    }
                }
                sums
            })
            .collect();
        gains(&sums, self.rows, f64::from(pair.new.sigma))
    }
}

/// One gain for all rows, and the smoothed deviations of the rows where they are more than noise.
fn gains(sums: &[Sums], by_row: bool, sigma: f64) -> Vec<f32> {
    let total = sums.iter().fold(Sums::default(), |a, b| Sums {
        new: a.new + b.new,
        past: a.past + b.past,
        count: a.count + b.count,
    });
    let height = sums.len();
    if !(total.count > 0.0 && total.past > 0.0 && total.new > 0.0) {
        return vec![1.0; height];
    }
    let overall = total.new / total.past;
    if !by_row {
        return vec![overall as f32; height];
    }
    let reach = (height / 40).max(1);
    let smooth: Vec<f64> = (0..height)
        .map(|y| {
            let rows = y.saturating_sub(reach)..(y + reach + 1).min(height);
            let (mut new, mut past) = (0.0, 0.0);
            for row in &sums[rows] {
                new += row.new;
                past += row.past;
            }
            if past > 0.0 {
                new / past / overall - 1.0
            } else {
                0.0
            }
        })
        .collect();
    let variance = smooth.iter().map(|d| d * d).sum::<f64>() / height as f64;
    // Of a mean over a band of rows: noise of both images, and texture that the state misplaces.
    let band = total.count / height as f64 * (2 * reach + 1) as f64;
    let level = total.past / total.count;
    let noise = 2.0 * sigma * sigma / (band * level * level);
    let clear = variance > 25.0 * noise + LEAST_DEVIATION * LEAST_DEVIATION;
    let keep = if clear { 1.0 } else { 0.0 };
    smooth
        .iter()
        .map(|d| (overall * (1.0 + keep * d)) as f32)
        .collect()
}

/// Deviations of rows below this are left to the texture that the state misplaces.
const LEAST_DEVIATION: f64 = 0.01;
