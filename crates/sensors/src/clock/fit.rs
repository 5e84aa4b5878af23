//! Device time to host time: a robust line through pairs whose host times are late by chance.
//!
//! `host = device (1 + drift) + offset + delay`: delays are never negative and have a long tail. The
//! line is fitted by least squares with Tukey's weights on the residuals' median deviation, and then
//! laid on a low quantile of the residuals, where delays are least.

use sphereflow_core::Stamp;
use sphereflow_core::statistics::mad_sigma_mut;
use std::collections::VecDeque;

/// Pairs that the line is fitted to; more make drift more certain and follow its changes later.
/// At 30 Hz these are 17 s.
const WINDOW: usize = 512;
/// Pairs from which on a slope is fitted; with fewer the drift is taken for 0.
const LEAST: usize = 30;
/// Between two fits so many pairs come in.
const EVERY: usize = 16;
/// Largest drift that a clock has; more is taken for a fault of the pairs. Quartz keeps 1e-4.
const LARGEST_DRIFT: f64 = 1e-3;
/// Rounds of weighted least squares.
const ROUNDS: usize = 8;
/// Tukey's constant, in standard deviations: 95 % efficient where errors are normal.
const TUKEY: f64 = 4.685;
/// Quantile of the residuals that the line is laid on.
const QUANTILE: f64 = 0.1;
/// A pair this far from the line, seconds, is no late arrival but a step of one of the clocks.
const STEP_S: f64 = 1.0;

/// What is known of a clock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClockState {
    /// How much faster than the device's the host's clock runs, as a share: 5e-5 is 50 ppm.
    pub drift: f64,
    /// Standard deviation of the arrivals about the line, seconds, outliers apart.
    pub jitter_s: f64,
    /// Pairs that the line is fitted to.
    pub pairs: usize,
    /// Times that one of the clocks stepped, and the fit began anew.
    pub steps: u64,
    /// Stamps that would not have come after the one before and were moved behind it.
    pub reordered: u64,
}

/// The running fit of one device's clock.
#[derive(Clone, Debug, Default)]
pub struct ClockFit {
    /// Device time and host time since the first pair, seconds.
    pairs: VecDeque<(f64, f64)>,
    origin: Option<(i64, Stamp)>,
    drift: f64,
    offset: f64,
    since_fit: usize,
    last: Option<(i64, Stamp)>,
    state: ClockState,
}

impl ClockFit {
    /// With nothing known.
    pub fn new() -> Self {
        Self::default()
    }

    /// What is known so far.
    pub fn state(&self) -> ClockState {
        ClockState {
            drift: self.drift,
            pairs: self.pairs.len(),
            ..self.state
        }
    }

    /// Host time of the reading at `device_ns`, which arrived at `arrived`. Stamps of readings whose
    /// device times increase increase, too: a new fit moves none behind an earlier one.
    pub fn stamp(&mut self, device_ns: i64, arrived: Stamp) -> Stamp {
        let (first_ns, first) = *self.origin.get_or_insert((device_ns, arrived));
        let device = (i128::from(device_ns) - i128::from(first_ns)) as f64 * 1e-9;
        let host = arrived.seconds_since(first);
        if (host - self.line(device)).abs() > STEP_S {
            self.state.steps += 1;
            *self = Self {
                state: self.state,
                last: self.last,
                ..Self::default()
            };
            self.origin = Some((device_ns, arrived));
            self.pairs.push_back((0.0, 0.0));
            return self.after_the_last(device_ns, arrived);
        }
        self.pairs.push_back((device, host));
        if self.pairs.len() > WINDOW {
            self.pairs.pop_front();
        }
        self.since_fit += 1;
        if self.since_fit >= EVERY || self.pairs.len() <= EVERY {
            self.since_fit = 0;
            self.fit();
        }
        self.after_the_last(device_ns, first.plus_seconds(self.line(device)))
    }

    fn line(&self, device: f64) -> f64 {
        device * (1.0 + self.drift) + self.offset
    }

    fn after_the_last(&mut self, device_ns: i64, stamp: Stamp) -> Stamp {
        let stamp = match self.last {
            Some((device, last)) if device_ns > device && stamp <= last => {
                self.state.reordered += 1;
                Stamp::from_ns(last.ns().saturating_add(1))
            }
            _ => stamp,
        };
        self.last = Some((device_ns, stamp));
        stamp
    }

    fn fit(&mut self) {
        let lateness: Vec<(f64, f64)> = self.pairs.iter().map(|(d, h)| (*d, h - d)).collect();
        let mut weights = vec![1.0; lateness.len()];
        let (mut slope, mut level) = (0.0, 0.0);
        for _ in 0..ROUNDS {
            let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
                lateness
                    .iter()
                    .zip(&weights)
                    .map(|((d, l), w)| w * f(*d, *l))
                    .sum()
            };
            let total = sum(&|_, _| 1.0).max(f64::MIN_POSITIVE);
            let (mean_d, mean_l) = (sum(&|d, _| d) / total, sum(&|_, l| l) / total);
            let spread = sum(&|d, _| (d - mean_d).powi(2));
            let enough = lateness.len() >= LEAST && spread > 0.0;
            slope = if enough {
                sum(&|d, l| (d - mean_d) * (l - mean_l)) / spread
            } else {
                0.0
            };
            slope = slope.clamp(-LARGEST_DRIFT, LARGEST_DRIFT);
            level = mean_l - slope * mean_d;
            let residuals: Vec<f64> = lateness
                .iter()
                .map(|(d, l)| l - level - slope * d)
                .collect();
            let sigma = mad_sigma_mut(&mut residuals.clone())
                .unwrap_or(0.0)
                .max(1e-9);
            self.state.jitter_s = sigma;
            for (weight, residual) in weights.iter_mut().zip(&residuals) {
                let share = residual / (TUKEY * sigma);
                *weight = if share.abs() < 1.0 {
                    (1.0 - share * share).powi(2)
                } else {
                    0.0
                };
            }
        }
        let mut residuals: Vec<f64> = lateness
            .iter()
            .map(|(d, l)| l - level - slope * d)
            .collect();
        residuals.sort_unstable_by(f64::total_cmp);
        let low = residuals[(QUANTILE * (residuals.len() - 1) as f64) as usize];
        (self.drift, self.offset) = (slope, level + low);
    }
}

#[cfg(test)]
mod tests;
