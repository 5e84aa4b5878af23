//! For tests: random flaws of any size in samples of any kind.

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Spoils one sample in `1 / share`.
pub struct Flaws {
    rng: ChaCha8Rng,
    share: f64,
}

impl Flaws {
    pub fn new(seed: u64, share: f64) -> Self {
        Self {
            rng: ChaCha8Rng::seed_from_u64(seed),
            share,
        }
    }

    /// True where the next thing is to be spoilt.
    pub fn strikes(&mut self) -> bool {
        self.rng.random_bool(self.share)
    }

    /// Any double: of all sizes and both signs, zeros, infinities and NaN.
    pub fn number(&mut self) -> f64 {
        let sign = if self.rng.random_bool(0.5) { 1.0 } else { -1.0 };
        match self.rng.random_range(0..10) {
            0 => f64::NAN,
            1 => f64::INFINITY * sign,
            2 => 0.0,
            3..6 => sign * 10f64.powf(self.rng.random_range(-3.0..6.0)),
            _ => sign * 10f64.powf(self.rng.random_range(-308.0..308.0)),
        }
    }

    /// One, two or all components spoilt, with a share.
    pub fn vector(&mut self, v: &mut Vector3<f64>) {
        if self.strikes() {
            let which = self.rng.random_range(0..7_usize);
            for axis in 0..3 {
                if which == 6 || which % 3 == axis {
                    v[axis] = self.number();
                }
            }
        }
    }

    /// A time step: repeated, backwards, of no length, a gap of seconds, a day, an age.
    pub fn step(&mut self, dt_s: f64) -> f64 {
        const STEPS: [f64; 9] = [0.0, -1.0, f64::NAN, 1e-300, 1e-9, 3.0, 86_400.0, 1e9, 1e300];
        if self.strikes() {
            STEPS[self.rng.random_range(0..STEPS.len())]
        } else {
            dt_s
        }
    }
}
