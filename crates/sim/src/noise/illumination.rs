//! Light that changes: lamps that flicker, seen row by row, and lenses that darken towards the corners.

use super::{RollingShutter, checks};
use sphereflow_core::{Result, Stamp};
use std::f64::consts::TAU;

/// A lamp: brightness is multiplied by `1 + amplitude sin(2 pi frequency t + phase)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flicker {
    /// Relative amplitude, 0 to below 1.
    pub amplitude: f64,
    /// Hz; a lamp on 50 Hz mains flickers at 100 Hz.
    pub frequency_hz: f64,
    /// Radians at stamp 0.
    pub phase_rad: f64,
}

impl Flicker {
    pub(crate) fn check(&self) -> Result<()> {
        checks::share("flicker.amplitude", self.amplitude)?;
        checks::non_negative("flicker.frequency_hz", self.frequency_hz)?;
        checks::finite("flicker.phase_rad", self.phase_rad)
    }

    /// The factor at `stamp`.
    pub fn gain(&self, stamp: Stamp) -> f64 {
        // The whole seconds and the rest apart: a Unix time times 100 Hz would lose the phase.
        let (seconds, rest_ns) = (
            stamp.ns().div_euclid(1_000_000_000),
            stamp.ns().rem_euclid(1_000_000_000),
        );
        let whole = (self.frequency_hz * seconds as f64).rem_euclid(1.0);
        let cycles = whole + self.frequency_hz * rest_ns as f64 * 1e-9;
        1.0 + self.amplitude * (TAU * cycles + self.phase_rad).sin()
    }

    /// The factor of row `y`: with a rolling shutter the flicker shows as bands across the image.
    pub fn row_gain(&self, stamp: Stamp, y: usize, shutter: Option<&RollingShutter>) -> f64 {
        self.gain(shutter.map_or(stamp, |s| s.row_stamp(stamp, y)))
    }
}

/// Factor of a lens that loses `corner_loss` of the light at the image corners, growing with the
/// square of the distance from the middle.
pub(crate) fn vignette(x: usize, y: usize, width: usize, height: usize, corner_loss: f64) -> f64 {
    let (cx, cy) = ((width as f64 - 1.0) / 2.0, (height as f64 - 1.0) / 2.0);
    let (dx, dy) = (x as f64 - cx, y as f64 - cy);
    let corner2 = (cx * cx + cy * cy).max(f64::MIN_POSITIVE);
    1.0 - corner_loss * (dx * dx + dy * dy) / corner2
}
