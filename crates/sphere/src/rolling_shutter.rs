//! Rolling shutter: when each row of an image is exposed.

use crate::lie::se3;
use sphereflow_core::{Pose, Twist};

/// Exposure of row `y` of `height` relative to the image's stamp, seconds: `((y + 1/2) / height -
/// 1/2) * readout_s`, so that the middle of the image is exposed at the stamp. `readout_s` is the
/// time from the first row to the end of the last; negative where the last row comes first. Rows
/// between the pixels' are allowed.
#[inline(always)]
pub fn row_time_s(y: f64, height: f64, readout_s: f64) -> f64 {
    ((y + 0.5) / height - 0.5) * readout_s
}

/// A camera that moves with `twist` while its rows are read, one after the other.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RollingShutter {
    /// Velocity during the exposure, camera's own frame.
    pub twist: Twist,
    /// Time from the first row to the end of the last, seconds: see [`row_time_s`].
    pub readout_s: f64,
}

impl RollingShutter {
    /// True where all rows see the same moment, or the camera is at rest.
    pub fn is_global(&self) -> bool {
        self.readout_s == 0.0 || self.twist == Twist::default()
    }

    /// Pose of the camera when row `y` was exposed, in the frame of the camera at the stamp.
    pub fn stamp_from_row(&self, y: usize, height: usize) -> Pose {
        let time_s = row_time_s(y as f64, height as f64, self.readout_s);
        se3::exp(&(self.twist.vector() * time_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn row_time_of_the_middle_is_the_stamp_and_that_of_the_border_half_the_readout() {
        assert_eq!(row_time_s(239.5, 480.0, 0.03), 0.0);
        assert_eq!(row_time_s(-0.5, 480.0, 0.03), -0.015);
        assert_eq!(row_time_s(479.5, 480.0, -0.03), -0.015);
    }

    #[test]
    fn row_pose_moves_against_the_twist_before_the_stamp() {
        let twist = Twist::from_vector(&[0.0, 0.0, 0.0, 2.0, 0.0, 0.0].into());
        let shutter = RollingShutter {
            twist,
            readout_s: 0.03,
        };
        // half the read-out less half a row, at 2 m/s
        let expected = -0.03 * 479.0 / 480.0;
        let x = shutter.stamp_from_row(0, 480).translation.x;
        assert!((x - expected).abs() < 1e-12, "{x} {expected}");
        assert!(!shutter.is_global() && RollingShutter::default().is_global());
    }
}
