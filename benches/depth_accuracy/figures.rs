//! What is asked of a run: errors, calibration, time.

use crate::cases::{Asked, Case};
use sphereflow_core::Plane;
use sphereflow_sphere::Camera;
use std::time::Duration;

/// Relative deviation up to which a pixel's range is claimed to be known.
const CLAIM: f32 = 0.05;

/// Collects errors frame by frame.
pub struct Judge {
    /// Solid angle of a row, any unit.
    weight: Vec<f64>,
    curve: Vec<(f64, f64)>,
    medians: Vec<f64>,
    squares: f64,
    pixels: f64,
    /// Errors and solid angle of the pixels that are claimed to be known.
    claimed: [f64; 2],
    ratios: Vec<f64>,
    times_ms: Vec<f64>,
}

/// The figures of a run.
pub struct Figures {
    half: f64,
    one: f64,
    mean: f64,
    max: f64,
    median: f64,
    normalised: f64,
    typical: f64,
    claimed: f64,
    share: f64,
    ms: f64,
}

impl Judge {
    pub fn new(camera: &Camera) -> Self {
        let height = camera.height();
        let weight = |y: usize| match camera.wraps_around() {
            true => ((y as f64 + 0.5) / height as f64 * std::f64::consts::PI).sin(),
            false => 1.0,
        };
        Self {
            weight: (0..height).map(weight).collect(),
            curve: Vec::new(),
            medians: Vec::new(),
            squares: 0.0,
            pixels: 0.0,
            claimed: [0.0; 2],
            ratios: Vec::new(),
            times_ms: Vec::new(),
        }
    }

    pub fn spent(&mut self, time: Duration) {
        self.times_ms.push(1e3 * time.as_secs_f64());
    }

    /// Thesis: section 4.1.1. E is the mean relative error over the image, percent.
    pub fn judge(&mut self, t_s: f64, range: &Plane<f32>, std: &Plane<f32>, truth: &Plane<f32>) {
        let (width, height) = truth.size();
        let (mut sum, mut weights) = (0.0, 0.0);
        let mut errors = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let (found, expected) = (f64::from(range[(x, y)]), f64::from(truth[(x, y)]));
                if !expected.is_finite() {
                    continue;
                }
                // An unknown pixel counts as wholly wrong.
                let error = if found.is_finite() {
                    (found - expected).abs() / expected
                } else {
                    1.0
                };
                sum += self.weight[y] * error;
                weights += self.weight[y];
                errors.push(error);
                if t_s >= 2.0 && found.is_finite() {
                    let ratio = (found - expected) / f64::from(std[(x, y)]);
                    self.squares += self.weight[y] * ratio * ratio;
                    self.pixels += self.weight[y];
                    if std[(x, y)] < CLAIM * range[(x, y)] {
                        self.claimed[0] += self.weight[y] * error;
                        self.claimed[1] += self.weight[y];
                    }
                    if (x + 7 * y) % 61 == 0 {
                        self.ratios.push(ratio.abs());
                    }
                }
            }
        }
        self.curve.push((t_s, 100.0 * sum / weights));
        if t_s >= 2.0 {
            self.medians.push(100.0 * middle(&mut errors));
        }
    }

    pub fn figures(mut self) -> Figures {
        let at = |t: f64| {
            let near =
                |a: &&(f64, f64), b: &&(f64, f64)| (a.0 - t).abs().total_cmp(&(b.0 - t).abs());
            self.curve.iter().min_by(near).map_or(f64::NAN, |p| p.1)
        };
        let late: Vec<f64> = self
            .curve
            .iter()
            .filter(|p| p.0 >= 2.0)
            .map(|p| p.1)
            .collect();
        Figures {
            half: at(0.5),
            one: at(1.0),
            mean: late.iter().sum::<f64>() / late.len() as f64,
            max: late.iter().copied().fold(0.0, f64::max),
            median: middle(&mut self.medians),
            normalised: (self.squares / self.pixels).sqrt(),
            // The median of |normal| is 0.6745.
            typical: middle(&mut self.ratios) / 0.6745,
            claimed: 100.0 * self.claimed[0] / self.claimed[1],
            share: 100.0 * self.claimed[1] / self.pixels,
            ms: middle(&mut self.times_ms),
        }
    }
}

fn middle(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    let at = values.len() / 2;
    *values.select_nth_unstable_by(at, f64::total_cmp).1
}

impl Figures {
    /// Names of the columns of [`Figures::row`].
    pub const HEADER: &str = "\
| case | E(0.5 s) % | E(1 s) % | mean 2-4 s % | max 2-4 s % | pixel median % | error/std rms | median | mean of known to 5 % (share) | ms | asked E(0.5 s), mean, max % | holds |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |";

    fn holds(&self, case: &Case) -> bool {
        let Asked { half, mean, max } = case.asked;
        // A run without 2 to 4 s holds nothing.
        self.half <= half && self.mean <= mean && self.max <= max
    }

    /// What several motions gave.
    pub fn summary(all: &[Self], name: &str, case: &Case) -> String {
        let list = |of: fn(&Self) -> f64| {
            let mut list: Vec<f64> = all.iter().map(of).collect();
            list.sort_by(f64::total_cmp);
            let mean = list.iter().sum::<f64>() / list.len() as f64;
            let (least, most) = (list[0], list[list.len() - 1]);
            format!("{mean:.2} ({least:.2} to {most:.2})")
        };
        let within = match case.asked == Asked::NOTHING {
            true => "nothing is asked".into(),
            false => {
                let count = all.iter().filter(|of| of.holds(case)).count();
                format!("{count} within what is asked")
            }
        };
        format!(
            "{name}, {} motions: mean {} %, max {} %, E(0.5 s) {} %, error/std {}; {within}",
            all.len(),
            list(|of| of.mean),
            list(|of| of.max),
            list(|of| of.half),
            list(|of| of.normalised),
        )
    }

    pub fn row(&self, case: &Case) -> String {
        let holds = self.holds(case);
        let calibrated = (0.5..=2.0).contains(&self.normalised);
        let verdict = match (holds, calibrated) {
            (true, true) => "yes",
            (true, false) => "error yes, std no",
            (false, true) => "error no, std yes",
            (false, false) => "no",
        };
        let verdict = match case.asked == Asked::NOTHING {
            true => "nothing asked",
            false => verdict,
        };
        format!(
            "| {} | {:.2} | {:.2} | {:.3} | {:.2} | {:.3} | {:.2} | {:.2} | {:.3} ({:.0}) | {:.1} | {} | {verdict} |",
            case.name,
            self.half,
            self.one,
            self.mean,
            self.max,
            self.median,
            self.normalised,
            self.typical,
            self.claimed,
            self.share,
            self.ms,
            case.asked,
        )
    }
}
