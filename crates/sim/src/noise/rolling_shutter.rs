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
        (y as f64 / self.height as f64 - 0.5) * self.readout_s
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
    fn rolling_shutter_middle_row_is_at_the_stamp_and_first_row_half_a_readout_before() {
        let shutter = RollingShutter::new(0.03, 480).unwrap();
        assert_eq!(shutter.row_time_s(240), 0.0);
        assert_eq!(shutter.row_time_s(0), -0.015);
        let stamp = Stamp::from_ns(1_000_000_000);
        assert_eq!(shutter.row_stamp(stamp, 480).ns(), 1_015_000_000);
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
