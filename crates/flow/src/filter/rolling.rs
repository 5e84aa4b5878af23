//! Light that runs over the rows of two images, whose rows are inclined to each other.
//!
//! Lamps flicker while the rows of an image are read one after the other. Between two images the gain is then a
//! number of the new image's row over one of the past image's row, and no number of the new row alone where the
//! camera has rolled.

use nalgebra::{DMatrix, DVector};

/// The same pixel of the world in both images.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub new: f32,
    pub past: f32,
    /// Rows in both images, pixels.
    pub row: f32,
    pub past_row: f32,
}

/// Both images' logarithms of light are lines between this many rows and one.
const PIECES: usize = 16;

/// Rounds in which pixels that do not fit are left out.
const ROUNDS: usize = 2;

/// Logarithms that are farther off belong to pixels that were hidden, or misplaced.
const OFF: f64 = 0.15;

/// What speaks for no pattern, as a share of what the pixels say: patterns that both images' rows explain alike
/// are then shared among them.
const HOLD: f64 = 1e-3;

/// Gain of each of `height` rows of the past image, from samples whose rows have the gains `rows` by the new
/// image alone; empty where nothing can be said.
pub(super) fn past_rows(samples: &[Sample], rows: &[f32], height: usize) -> Vec<f32> {
    let mut found: Option<DVector<f64>> = None;
    for _ in 0..ROUNDS {
        let explained = |sample: &Sample, places: &[(usize, f64); 4]| match &found {
            Some(found) => places.iter().map(|(i, share)| found[*i] * share).sum(),
            None => f64::from(rows[(sample.row as usize).min(height - 1)].ln()),
        };
        let mut normal = Normal::new();
        for sample in samples {
            let ratio = f64::from((sample.new / sample.past).ln());
            let places = places(sample, height);
            if (ratio - explained(sample, &places)).abs() < OFF {
                normal.add(&places, ratio, f64::from(sample.past).powi(2));
            }
        }
        found = normal.solve();
        if found.is_none() {
            return Vec::new();
        }
    }
    let Some(found) = found else {
        return Vec::new();
    };
    let gain = |y: usize| {
        let [(low, s), (high, t)] = between(y as f32, height);
        (s * found[low + KNOTS] + t * found[high + KNOTS]).exp() as f32
    };
    (0..height).map(gain).collect()
}

const KNOTS: usize = PIECES + 1;

/// The knots around a row, and their shares.
fn between(row: f32, height: usize) -> [(usize, f64); 2] {
    let place = f64::from(row) / (height - 1) as f64 * PIECES as f64;
    let low = (place.max(0.0) as usize).min(PIECES - 1);
    let share = place - low as f64;
    [(low, 1.0 - share), (low + 1, share)]
}

/// Those of the new image's row, and of the past image's.
fn places(sample: &Sample, height: usize) -> [(usize, f64); 4] {
    let [a, b] = between(sample.row, height);
    let [c, d] = between(sample.past_row, height);
    [a, b, (c.0 + KNOTS, c.1), (d.0 + KNOTS, d.1)]
}

/// Normal equations.
struct Normal {
    matrix: DMatrix<f64>,
    vector: DVector<f64>,
}

impl Normal {
    fn new() -> Self {
        Self {
            matrix: DMatrix::zeros(2 * KNOTS, 2 * KNOTS),
            vector: DVector::zeros(2 * KNOTS),
        }
    }

    fn add(&mut self, places: &[(usize, f64); 4], value: f64, weight: f64) {
        for (i, own) in places {
            self.vector[*i] += weight * own * value;
            for (j, other) in places {
                self.matrix[(*i, *j)] += weight * own * other;
            }
        }
    }

    fn solve(mut self) -> Option<DVector<f64>> {
        let hold = HOLD * self.matrix.trace() / (2 * KNOTS) as f64;
        for i in 0..2 * KNOTS {
            self.matrix[(i, i)] += hold;
        }
        Some(self.matrix.cholesky()?.solve(&self.vector))
    }
}
