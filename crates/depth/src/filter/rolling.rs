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
    /// What the past brightness would change by if 1/Z were larger by its deviation.
    pub misplaced: f32,
    /// What it would change by if the place were farther right, and lower, by the pose's deviation.
    pub shifted: [f32; 2],
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
/// image alone; empty where nothing can be said. `noise` is the standard deviation of residuals.
pub(super) fn past_rows(samples: &[Sample], rows: &[f32], height: usize, noise: f32) -> Vec<f32> {
    let mut found: Option<DVector<f64>> = None;
    for _ in 0..ROUNDS {
        let explained = |sample: &Sample, places: &[(usize, f64); 6]| match &found {
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
        found = normal.solve(f64::from(noise).powi(2));
        if found.is_none() {
            return Vec::new();
        }
    }
    let Some(found) = found else {
        return Vec::new();
    };
    // Where the new image's rows alone explain more, the past image's have nothing to say.
    if explained_share(samples, rows, &found, height) < 0.0 {
        return Vec::new();
    }
    let gain = |y: usize| {
        let [(low, s), (high, t)] = between(y as f32, height);
        (s * found[low + KNOTS] + t * found[high + KNOTS]).exp() as f32
    };
    (0..height).map(gain).collect()
}

const KNOTS: usize = PIECES + 1;

/// Share of the variance left by the new image's rows alone that the past image's rows explain besides.
fn explained_share(samples: &[Sample], rows: &[f32], found: &DVector<f64>, height: usize) -> f64 {
    let (mut alone, mut both) = (0.0, 0.0);
    for sample in samples {
        let ratio = f64::from((sample.new / sample.past).ln());
        let own = ratio - f64::from(rows[(sample.row as usize).min(height - 1)].ln());
        let explained = |(i, share): &(usize, f64)| found[*i] * share;
        let left = ratio - places(sample, height).iter().map(explained).sum::<f64>();
        let weight = f64::from(sample.past).powi(2);
        // Both by the same pixels.
        if own.abs() < OFF && left.abs() < OFF {
            alone += weight * own * own;
            both += weight * left * left;
        }
    }
    if alone > 0.0 { 1.0 - both / alone } else { 0.0 }
}

/// The knots around a row, and their shares.
fn between(row: f32, height: usize) -> [(usize, f64); 2] {
    let place = f64::from(row) / (height - 1) as f64 * PIECES as f64;
    let low = (place.max(0.0) as usize).min(PIECES - 1);
    let share = place - low as f64;
    [(low, 1.0 - share), (low + 1, share)]
}

/// Those of the new image's row, of the past image's, and of what ranges of the new image's row are off by.
fn places(sample: &Sample, height: usize) -> [(usize, f64); 6] {
    let [a, b] = between(sample.row, height);
    let [c, d] = between(sample.past_row, height);
    let off = f64::from(sample.misplaced / sample.past);
    [
        a,
        b,
        (c.0 + KNOTS, c.1),
        (d.0 + KNOTS, d.1),
        (a.0 + 2 * KNOTS, a.1 * off),
        (b.0 + 2 * KNOTS, b.1 * off),
    ]
}

/// Normal equations.
struct Normal {
    matrix: DMatrix<f64>,
    vector: DVector<f64>,
}

impl Normal {
    fn new() -> Self {
        Self {
            matrix: DMatrix::zeros(3 * KNOTS, 3 * KNOTS),
            vector: DVector::zeros(3 * KNOTS),
        }
    }

    fn add(&mut self, places: &[(usize, f64); 6], value: f64, weight: f64) {
        for (i, own) in places {
            self.vector[*i] += weight * own * value;
            for (j, other) in places {
                self.matrix[(*i, *j)] += weight * own * other;
            }
        }
    }

    /// Ranges are off by about one of their deviations; `noise2` is a residual's variance.
    fn solve(mut self, noise2: f64) -> Option<DVector<f64>> {
        let light = (0..2 * KNOTS).map(|i| self.matrix[(i, i)]).sum::<f64>();
        let hold = HOLD * light / (2 * KNOTS) as f64;
        for i in 0..3 * KNOTS {
            self.matrix[(i, i)] += if i < 2 * KNOTS { hold } else { noise2 };
        }
        Some(self.matrix.cholesky()?.solve(&self.vector))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 320;
    const HEIGHT: usize = 240;

    /// Of ten percent: the pieces are lines, and what both rows explain alike is shared among them.
    const WITHIN: f32 = 0.01;

    fn light(row: f32, phase: f32) -> f32 {
        1.0 + 0.1 * (std::f32::consts::TAU * (0.8 * row / HEIGHT as f32 + phase)).sin()
    }

    /// Samples of a camera that has rolled by `roll` rad, in light that runs over both images.
    fn samples(roll: f32) -> Vec<Sample> {
        let mut samples = Vec::new();
        for (x, y) in (0..HEIGHT)
            .step_by(4)
            .flat_map(|y| (0..WIDTH).map(move |x| (x, y)))
        {
            let (right, down) = (x as f32 - 159.5, y as f32 - 119.5);
            let (row, past_row) = (y as f32, 119.5 + roll.cos() * down + roll.sin() * right);
            if (0.0..=(HEIGHT - 1) as f32).contains(&past_row) {
                let world = 128.0 + 60.0 * (0.1 * right).sin() * (0.07 * down).cos();
                samples.push(Sample {
                    new: world * light(row, 0.1),
                    past: world * light(past_row, 0.6),
                    row,
                    past_row,
                    misplaced: 0.0,
                    shifted: [0.0; 2],
                });
            }
        }
        samples
    }

    /// Largest error of the gains of what is seen, with the new rows' gain as the mean of what is left.
    fn largest_error(samples: &[Sample], past: &[f32]) -> f32 {
        let left = |s: &Sample| s.new / (s.past * past[s.past_row.round() as usize]);
        let mut rows = vec![(0.0_f32, 0.0_f32); HEIGHT];
        for sample in samples {
            let row = &mut rows[sample.row as usize];
            (row.0, row.1) = (row.0 + left(sample), row.1 + 1.0);
        }
        let off = |s: &Sample| {
            let (sum, count) = rows[s.row as usize];
            (left(s) * count / sum - 1.0).abs()
        };
        samples.iter().map(off).fold(0.0, f32::max)
    }

    #[test]
    fn past_rows_of_a_rolled_camera_explain_light_that_runs_over_both_images() {
        for roll in [0.1_f32, -0.2, 0.3] {
            let samples = samples(roll);
            let alone = largest_error(&samples, &[1.0; HEIGHT]);
            let past = past_rows(&samples, &[1.0; HEIGHT], HEIGHT, 1.0);
            let both = largest_error(&samples, &past);
            assert!(alone > 3.0 * WITHIN, "{roll}: {alone}");
            assert!(both < WITHIN, "{roll}: {both}");
        }
    }

    #[test]
    fn past_rows_of_ranges_that_are_off_alike_have_no_gain() {
        let mut samples = samples(0.2);
        for sample in &mut samples {
            // Paint that both rows could explain, were it not for its sign.
            let paint = 8.0 * (0.05 * sample.past_row).sin() + 4.0;
            (sample.past, sample.misplaced) = (sample.new - paint, paint);
        }
        let past = past_rows(&samples, &[1.0; HEIGHT], HEIGHT, 1.0);
        let off = |s: &Sample| (past[s.past_row.round() as usize] - 1.0).abs();
        let largest = samples.iter().map(off).fold(0.0, f32::max);
        assert!(largest < WITHIN, "{largest}");
    }

    #[test]
    fn past_rows_in_constant_light_have_no_gain() {
        let mut samples = samples(0.2);
        samples.iter_mut().for_each(|s| s.past = s.new);
        let past = past_rows(&samples, &[1.0; HEIGHT], HEIGHT, 1.0);
        assert!(
            past.iter().all(|gain| (gain - 1.0).abs() < 1e-6),
            "{past:?}"
        );
    }
}
