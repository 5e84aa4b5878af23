//! Rolling shutter: when each row of an image is exposed.

use super::checks;
use sphereflow_core::{Error, Result, Stamp};

/// Row `y` of `height` is exposed at `stamp + (y / height - 1/2) readout_s`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RollingShutter {
    readout_s: f64,
    height: usize,
}

impl RollingShutter {
    /// `readout_s`: time from the first row to the end of the last (30 ms for a Kinect v1), negative
    /// for a sensor read from the bottom, 0 for a global shutter. `height`: rows of the image.
    ///
    /// # Errors
    /// [`Error::Value`] where `readout_s` is not finite or `height` is 0.
    pub fn new(readout_s: f64, height: usize) -> Result<Self> {
        checks::finite("readout_s", readout_s)?;
        if height == 0 {
            return Err(Error::value("height", "at least one row", height));
        }
        Ok(Self { readout_s, height })
    }

    /// Time from the first row to the end of the last, seconds.
    pub fn readout_s(&self) -> f64 {
        self.readout_s
    }

    /// Exposure of row `y` relative to the image's stamp, seconds.
    pub fn row_time_s(&self, y: usize) -> f64 {
        sphereflow_sphere::row_time_s(y as f64, self.height as f64, self.readout_s)
    }

    /// Exposure of row `y` of the image stamped `stamp`.
    pub fn row_stamp(&self, stamp: Stamp, y: usize) -> Stamp {
        stamp.plus_seconds(self.row_time_s(y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rolling_shutter_rows_lie_evenly_about_the_stamp() {
        let shutter = RollingShutter::new(0.03, 480).unwrap();
        // half a row before and after
        assert!((shutter.row_time_s(239) + shutter.row_time_s(240)).abs() < 1e-15);
        assert!((shutter.row_time_s(0) + 0.015 - 0.03 / 960.0).abs() < 1e-15);
        let stamp = Stamp::from_ns(1_000_000_000);
        assert_eq!(shutter.row_stamp(stamp, 479).ns(), 1_014_968_750);
        assert_eq!(
            RollingShutter::new(0.0, 480).unwrap().row_stamp(stamp, 7),
            stamp
        );
    }

    #[test]
    fn rolling_shutter_without_rows_or_with_nan_readout_is_an_error() {
        let text = |r: Result<RollingShutter>| r.unwrap_err().to_string();
        assert!(text(RollingShutter::new(0.03, 0)).starts_with("height"));
        assert!(text(RollingShutter::new(f64::NAN, 4)).starts_with("readout_s"));
    }
}
