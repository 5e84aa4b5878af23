//! Random numbers that are the same on every platform.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, StandardUniform};

/// ChaCha of a seed.
pub struct Random(ChaCha8Rng);

impl Random {
    /// The same numbers for the same seed.
    pub fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// In [0, 1).
    pub fn uniform(&mut self) -> f64 {
        StandardUniform.sample(&mut self.0)
    }

    /// Uniform between two numbers.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// An index below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        ((self.uniform() * count as f64) as usize).min(count.saturating_sub(1))
    }

    /// Independent normal numbers of a standard deviation.
    pub fn normal<const N: usize>(&mut self, sigma: f64) -> SVector<f64, N> {
        SVector::from_fn(|_, _| {
            let value: f64 = StandardNormal.sample(&mut self.0);
            sigma * value
        })
    }
}
