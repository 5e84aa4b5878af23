//! Settings of the depth filter.

use crate::{Error, Result};
use sphereflow_core::checks::{each, positive, within};

/// How brightness may change from image to image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Brightness {
    /// Not at all.
    Constant,
    /// By a gain per image and, where the rows say so clearly, per row (flicker, rolling light).
    Measured,
}

/// Settings of [`crate::DepthFilter`]. The defaults are for a camera of 640x480 at 60 Hz; nothing has to be
/// tuned to a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthFilterConfig {
    /// Pixels of the image to a side of one of the filter's: 1 to 4. Two lose nothing that noise
    /// leaves, at a quarter of the time.
    pub binning: usize,
    /// Distances, in frames, to the past images that each image is compared with; increasing. All images up to the
    /// longest are kept, at twenty bytes per pixel of the filter. At the start the first image stands in for lags that
    /// are not there yet.
    pub lags: Vec<usize>,
    /// Standard deviation of the image noise, grey levels; `None` to measure it.
    pub sigma_grey: Option<f64>,
    /// Range everywhere before the first image, metres.
    pub initial_range_m: f64,
    /// Surfaces farther than this, metres, are not looked for.
    pub farthest_m: f64,
    /// How much 1/Z departs from planes, per metre and radian.
    pub roughness_per_m_rad: f64,
    /// Share of the information that survives a frame.
    pub memory: f64,
    /// Frames after the start in which less survives, so that early mistakes are forgotten: four
    /// fifths in the first two
    /// thirds of them, then more and more.
    pub start_frames: usize,
    /// Changes of brightness.
    pub brightness: Brightness,
    /// Whether past images are left out where a pixel was hidden in them.
    pub occlusion: bool,
    /// States of the past that are kept, at most, so that surfaces which come into view again are known at once; 0
    /// for none. Each takes eight bytes per pixel of the filter. Only with `occlusion`.
    pub keyframes: usize,
}

impl Default for DepthFilterConfig {
    fn default() -> Self {
        Self {
            binning: 2,
            lags: vec![1, 3, 7, 16, 32, 64],
            sigma_grey: None,
            initial_range_m: 1.0,
            farthest_m: 20.0,
            roughness_per_m_rad: 0.012,
            memory: 0.997,
            start_frames: 30,
            brightness: Brightness::Measured,
            occlusion: true,
            keyframes: 24,
        }
    }
}

impl DepthFilterConfig {
    pub(super) fn check(&self) -> Result<()> {
        within("binning", self.binning, 1..=4)?;
        let increases = self.lags.windows(2).all(|pair| pair[0] < pair[1]);
        if self.lags.is_empty() || self.lags[0] == 0 || !increases || self.lags.len() > 8 {
            let expected = "one to eight increasing numbers of frames";
            return Err(Error::value("lags", expected, format!("{:?}", self.lags)));
        }
        if self.lags[self.lags.len() - 1] > 240 {
            return Err(Error::value(
                "lags",
                "at most 240 frames",
                format!("{:?}", self.lags),
            ));
        }
        if let Some(sigma) = self.sigma_grey {
            positive("sigma_grey", sigma)?;
        }
        let settings = [
            ("initial_range_m", self.initial_range_m),
            ("farthest_m", self.farthest_m),
            ("roughness_per_m_rad", self.roughness_per_m_rad),
        ];
        each(positive, &settings)?;
        if !(self.memory > 0.5 && self.memory <= 1.0) {
            return Err(Error::value("memory", "above 0.5, at most 1", self.memory));
        }
        Ok(())
    }
}
