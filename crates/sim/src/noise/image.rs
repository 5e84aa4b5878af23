//! What a camera does to a perfect picture: lens, lamps, blur and grey-level noise.

use super::illumination::vignette;
use super::stream::{Purpose, Streams};
use super::{Flicker, RollingShutter, blur, checks};
use rand::RngExt;
use rand_distr::StandardNormal;
use rayon::prelude::*;
use sphereflow_core::{Plane, Result, Stamp};

/// Parameters of [`ImageNoise`]; the default changes nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImageNoiseParameters {
    /// Standard deviation of the additive noise of each channel, grey levels.
    pub sigma_grey: f64,
    /// Standard deviation of the Gaussian blur, pixels; 0 for none.
    pub blur_sigma_px: f64,
    /// A flickering lamp.
    pub flicker: Option<Flicker>,
    /// Row times of the sensor: with it the flicker becomes bands, without it every row has the gain
    /// of the image's stamp.
    pub rolling_shutter: Option<RollingShutter>,
    /// Share of the light lost at the corners, 0 to below 1.
    pub vignetting: f64,
}

/// Lens, lamps, blur and noise, in this order; colour values are rounded and clamped to 0..=255,
/// grey values of type `f32` are neither.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImageNoise {
    parameters: ImageNoiseParameters,
    seed: u64,
}

impl ImageNoise {
    /// # Errors
    /// [`sphereflow_core::Error::Value`] naming the parameter out of range.
    pub fn new(parameters: ImageNoiseParameters, seed: u64) -> Result<Self> {
        checks::non_negative("sigma_grey", parameters.sigma_grey)?;
        checks::non_negative("blur_sigma_px", parameters.blur_sigma_px)?;
        checks::share("vignetting", parameters.vignetting)?;
        if let Some(flicker) = &parameters.flicker {
            flicker.check()?;
        }
        Ok(Self { parameters, seed })
    }

    /// The parameters.
    pub fn parameters(&self) -> &ImageNoiseParameters {
        &self.parameters
    }

    /// Changes a colour picture taken at `stamp` (which sets the flicker), frame `frame_index` (which
    /// sets the noise).
    pub fn apply_rgb(&self, image: &mut Plane<[u8; 3]>, stamp: Stamp, frame_index: u64) {
        if self.is_none() {
            return;
        }
        let (width, height) = image.size();
        let mut values: Vec<f32> = image
            .data()
            .as_flattened()
            .iter()
            .map(|v| f32::from(*v))
            .collect();
        self.corrupt(&mut values, (width, height, 3), stamp, frame_index);
        let bytes = image.data_mut().as_flattened_mut();
        for (byte, value) in bytes.iter_mut().zip(&values) {
            // A cast saturates at 0 and 255.
            *byte = value.round_ties_even() as u8;
        }
    }

    /// Changes a grey picture (levels 0 to 255); see [`ImageNoise::apply_rgb`].
    pub fn apply_grey(&self, image: &mut Plane<f32>, stamp: Stamp, frame_index: u64) {
        let (width, height) = image.size();
        self.corrupt(image.data_mut(), (width, height, 1), stamp, frame_index);
    }

    /// True where nothing would change.
    fn is_none(&self) -> bool {
        let p = &self.parameters;
        p.sigma_grey == 0.0 && p.blur_sigma_px == 0.0 && p.flicker.is_none() && p.vignetting == 0.0
    }

    /// Interleaved values of `(width, height, channels)`.
    fn corrupt(
        &self,
        values: &mut [f32],
        (width, height, channels): (usize, usize, usize),
        stamp: Stamp,
        frame_index: u64,
    ) {
        let p = &self.parameters;
        let stride = width * channels;
        if values.is_empty() {
            return;
        }
        if p.flicker.is_some() || p.vignetting > 0.0 {
            values
                .par_chunks_mut(stride)
                .enumerate()
                .for_each(|(y, row)| {
                    let lamp = p.flicker.map_or(1.0, |flicker| {
                        flicker.row_gain(stamp, y, p.rolling_shutter.as_ref())
                    });
                    for (x, pixel) in row.chunks_exact_mut(channels).enumerate() {
                        let gain = (lamp * vignette(x, y, width, height, p.vignetting)) as f32;
                        pixel.iter_mut().for_each(|v| *v *= gain);
                    }
                });
        }
        if p.blur_sigma_px > 0.0 {
            blur::gaussian(values, width, channels, p.blur_sigma_px);
        }
        if p.sigma_grey > 0.0 {
            let streams = Streams::new(self.seed, Purpose::Image, frame_index);
            values
                .par_chunks_mut(stride)
                .enumerate()
                .for_each(|(y, row)| {
                    let mut rng = streams.chunk(y as u64);
                    for value in row {
                        let normal: f32 = rng.sample(StandardNormal);
                        *value += p.sigma_grey as f32 * normal;
                    }
                });
        }
    }
}
