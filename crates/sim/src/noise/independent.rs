//! Depth noise that is independent from pixel to pixel: what most papers assume.

use super::checks;
use super::depth::edit;
use super::kinect::quantise;
use super::stream::{Purpose, Streams};
use rand::RngExt;
use rand_distr::StandardNormal;
use rayon::prelude::*;
use sphereflow_core::{DepthMap, Result};

/// White Gaussian noise of 1/Z and, optionally, rounding of 1/Z to steps. For every camera.
#[derive(Clone, Debug, PartialEq)]
pub struct IndependentNoise {
    sigma_inv_m: f64,
    quantum_inv_m: f64,
    seed: u64,
}

impl IndependentNoise {
    /// `sigma_inv_m`: standard deviation of 1/Z before rounding, 1/m. `quantum_inv_m`: step of 1/Z,
    /// 1/m, 0 for none.
    ///
    /// # Errors
    /// [`sphereflow_core::Error::Value`] naming the parameter that is negative or not finite.
    pub fn new(sigma_inv_m: f64, quantum_inv_m: f64, seed: u64) -> Result<Self> {
        checks::non_negative("sigma_inv_m", sigma_inv_m)?;
        checks::non_negative("quantum_inv_m", quantum_inv_m)?;
        Ok(Self {
            sigma_inv_m,
            quantum_inv_m,
            seed,
        })
    }

    /// What the sensor reads of `depth` in frame `frame_index`. Unknown pixels stay unknown; a pixel
    /// whose noisy 1/Z is not positive becomes unknown.
    pub fn apply(&self, depth: &DepthMap, frame_index: u64) -> DepthMap {
        let mut noisy = depth.clone();
        self.apply_in_place(&mut noisy, frame_index);
        noisy
    }

    /// [`IndependentNoise::apply`] without a new image.
    pub fn apply_in_place(&self, depth: &mut DepthMap, frame_index: u64) {
        let streams = Streams::new(self.seed, Purpose::IndependentDepth, frame_index);
        let (sigma, quantum) = (self.sigma_inv_m as f32, self.quantum_inv_m as f32);
        let width = depth.size().0.max(1);
        edit(depth, |metres| {
            metres
                .par_chunks_mut(width)
                .enumerate()
                .for_each(|(y, row)| {
                    let mut rng = streams.chunk(y as u64);
                    for value in row.iter_mut() {
                        let normal: f32 = rng.sample(StandardNormal);
                        *value = 1.0 / *value + sigma * normal;
                    }
                    quantise(row, quantum);
                    row.iter_mut().for_each(|value| *value = 1.0 / *value);
                });
        });
    }
}
