//! The settings of the odometry.

use crate::Result;
use crate::keyframe::KeyframePolicy;
use sphereflow_alignment::Config;
use sphereflow_core::Error;

/// Settings of [`crate::DepthOdometry`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OdometryConfig {
    /// How two images are aligned.
    pub alignment: Config,
    /// When keyframes are made.
    pub keyframes: KeyframePolicy,
    /// Rolling shutter: time between the exposures of the first and the last row, seconds; the
    /// stamp is that of the middle row. 0: all rows at once. Negative: the last row comes first.
    pub readout_s: f64,
    /// True where [`super::OdometryResult::keyframes`] is wanted: a map that keeps keyframes. Costs a
    /// copy of the image without its finest level a keyframe.
    pub emit_keyframes: bool,
}

impl OdometryConfig {
    /// Checks every setting.
    ///
    /// # Errors
    /// A core value error naming the first setting out of its range.
    pub fn validate(&self) -> Result<()> {
        self.alignment.validate()?;
        self.keyframes.validate()?;
        if self.readout_s.is_finite() && self.readout_s.abs() <= MAX_READOUT_S {
            return Ok(());
        }
        let expected = format!("at most {MAX_READOUT_S} s between first and last row");
        Err(Error::value("readout_s", expected, self.readout_s))
    }
}

/// Longer than any camera takes for an image.
const MAX_READOUT_S: f64 = 0.2;
