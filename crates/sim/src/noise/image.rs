//! What a camera does to a perfect picture: lens, lamps, blur and grey-level noise.

use super::illumination::vignette;
use super::stream::{Purpose, Streams};
use super::{Flicker, RollingShutter, blur, checks, normals};
use crate::rounding::byte;
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
        let size = image.size();
        let stride = 3 * size.0;
        if stride == 0 {
            return;
        }
        let streams = Streams::new(self.seed, Purpose::Image, frame_index);
        let bytes = image.data_mut().as_flattened_mut();
        if self.parameters.blur_sigma_px > 0.0 {
            let mut values: Vec<f32> = bytes.iter().map(|v| f32::from(*v)).collect();
            self.corrupt(&mut values, size, 3, stamp, &streams);
            to_bytes(&values, bytes);
            return;
        }
        // Without blur every row is for itself, and a buffer of one row stays in the cache.
        bytes.par_chunks_mut(stride).enumerate().for_each_init(
            || vec![0.0; stride],
            |values, (y, row)| {
                for (value, byte) in values.iter_mut().zip(row.iter()) {
                    *value = f32::from(*byte);
                }
                self.light(values, y, size, 3, stamp);
                self.add_noise(values, y, &streams);
                to_bytes(values, row);
            },
        );
    }

    /// Changes a grey picture (levels 0 to 255); see [`ImageNoise::apply_rgb`].
    pub fn apply_grey(&self, image: &mut Plane<f32>, stamp: Stamp, frame_index: u64) {
        let size = image.size();
        let streams = Streams::new(self.seed, Purpose::Image, frame_index);
        if !image.data().is_empty() {
            self.corrupt(image.data_mut(), size, 1, stamp, &streams);
        }
    }

    /// True where nothing would change.
    fn is_none(&self) -> bool {
        let p = &self.parameters;
        p.sigma_grey == 0.0 && p.blur_sigma_px == 0.0 && p.flicker.is_none() && p.vignetting == 0.0
    }

    /// A whole image of interleaved channels, `size` = width, height; not empty.
    fn corrupt(
        &self,
        values: &mut [f32],
        size: (usize, usize),
        channels: usize,
        stamp: Stamp,
        streams: &Streams,
    ) {
        let stride = size.0 * channels;
        let rows = |values: &mut [f32], change: &(dyn Fn(usize, &mut [f32]) + Sync)| {
            let rows = values.par_chunks_mut(stride).enumerate();
            rows.for_each(|(y, row)| change(y, row));
        };
        rows(values, &|y, row| self.light(row, y, size, channels, stamp));
        if self.parameters.blur_sigma_px > 0.0 {
            blur::gaussian(values, size.0, channels, self.parameters.blur_sigma_px);
        }
        rows(values, &|y, row| self.add_noise(row, y, streams));
    }

    /// Lamp and lens on row `y`.
    fn light(
        &self,
        row: &mut [f32],
        y: usize,
        (width, height): (usize, usize),
        channels: usize,
        stamp: Stamp,
    ) {
        let p = &self.parameters;
        if p.flicker.is_none() && p.vignetting == 0.0 {
            return;
        }
        let lamp = p.flicker.map_or(1.0, |flicker| {
            flicker.row_gain(stamp, y, p.rolling_shutter.as_ref())
        });
        for (x, pixel) in row.chunks_exact_mut(channels).enumerate() {
            let gain = (lamp * vignette(x, y, width, height, p.vignetting)) as f32;
            pixel.iter_mut().for_each(|v| *v *= gain);
        }
    }

    /// Noise on row `y`, from a stream of its own.
    fn add_noise(&self, row: &mut [f32], y: usize, streams: &Streams) {
        let sigma = self.parameters.sigma_grey as f32;
        if sigma > 0.0 {
            let mut rng = streams.chunk(y as u64);
            normals::for_each(row, &mut rng, |value, normal| *value += sigma * normal);
        }
    }
}

/// Rounded and clamped.
fn to_bytes(values: &[f32], bytes: &mut [u8]) {
    for (out, value) in bytes.iter_mut().zip(values) {
        *out = byte(*value);
    }
}
