//! The settings of the self-calibration, with the reasons for their defaults.

use crate::Result;
use sphereflow_core::Error;
use sphereflow_core::checks::{each, positive, within};

/// Settings of [`crate::SelfCalibrator`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfCalibrationConfig {
    /// Estimate what is left of the lens: focal lengths, principal point, distortion.
    pub lens: bool,
    /// Estimate the field by which 1/Z is wrong.
    pub field: bool,
    /// Estimate the rolling shutter's read-out time.
    pub readout: bool,
    /// The read-out time so far, seconds; the prior's mean. 0 for a global shutter.
    pub readout_s: f64,
    /// Gauss-Newton steps.
    pub iterations: usize,
    /// Side of the blocks of pixels that are averaged first, for an image
    /// [`sphereflow_alignment::REFERENCE_WIDTH`] pixels wide, 1 to 32. What is looked for is smooth: half the side
    /// takes four times as long and finds the same.
    pub block: usize,
    /// Number of domains wanted.
    pub domains: usize,
    /// Pairs of frames at most; they are spread evenly.
    pub max_pairs: usize,
    /// Fewer pairs than this say nothing.
    pub min_pairs: usize,
    /// The two frames of a pair are at least so many frames apart. Neighbours see the same surface
    /// at the same place of the image, where the same error cancels.
    pub min_gap: usize,
    /// And at most so many.
    pub max_gap: usize,
    /// A pair must have moved this far, metres; rotation counts at the mean distance of the scene.
    pub min_motion_m: f64,
    /// And must not have turned further, radians: too little overlap is left.
    pub max_turn_rad: f64,
    /// And must not have moved further, metres.
    pub max_distance_m: f64,
    /// Prior: how far any distortion term bends the rays at the image's border, in the image plane
    /// at unit distance. 0.03 is 16 pixels of a 640x480 Kinect: what a wrong lens does.
    pub lens_std: f64,
    /// Prior: relative error of the focal lengths, and of the principal point as a share of them.
    /// Narrow: a camera frame turned against the lens moves the principal point, bends the image and
    /// tilts the field, and only the small differences between these tell where the axis is.
    pub focal_std: f64,
    /// Prior: how much any term of the field changes 1/Z where it is largest: relative, and in 1/m.
    /// Kinects were found wrong by a quarter to the whole of 2 %.
    pub field_std: f64,
    /// Prior: read-out time, seconds. A frame lasts 33 ms, and no read-out lasts longer.
    pub readout_std_s: f64,
    /// A parameter, or a combination of them, is observable where the motion reduced its standard
    /// deviation to this share of the prior's.
    pub observable_share: f64,
    /// Residuals are never weighted as better than this, 1/m: the discretisation of exact depth. A
    /// larger one would let domains on creases, which no parameter explains, bend the parameters.
    pub least_noise: f64,
}

impl Default for SelfCalibrationConfig {
    fn default() -> Self {
        Self {
            lens: true,
            field: true,
            readout: true,
            readout_s: 0.0,
            iterations: 6,
            block: 8,
            domains: 500,
            max_pairs: 300,
            min_pairs: 12,
            min_gap: 5,
            max_gap: 20,
            min_motion_m: 0.05,
            max_turn_rad: 0.6,
            max_distance_m: 0.8,
            lens_std: 0.03,
            focal_std: 0.005,
            field_std: 0.02,
            readout_std_s: 0.02,
            observable_share: 0.5,
            least_noise: 2e-5,
        }
    }
}

impl SelfCalibrationConfig {
    /// The read-out time alone.
    #[must_use]
    pub fn readout_only() -> Self {
        Self {
            lens: false,
            field: false,
            ..Self::default()
        }
    }

    /// Checks every setting.
    ///
    /// # Errors
    /// A core value error naming the first setting out of its range.
    pub fn validate(&self) -> Result<()> {
        if !(self.lens || self.field || self.readout) {
            let expected = "at least one of them to estimate";
            return Err(Error::value("lens, field, readout", expected, "none"));
        }
        let counts = [
            ("iterations", self.iterations, 1, 50),
            ("block", self.block, 1, 32),
            ("domains", self.domains, 40, 100_000),
            ("max_pairs", self.max_pairs, self.min_pairs, 1_000_000),
            ("min_pairs", self.min_pairs, 2, 1_000_000),
            ("min_gap", self.min_gap, 1, 1000),
            ("max_gap", self.max_gap, self.min_gap, 1000),
        ];
        for (name, value, low, high) in counts {
            within(name, value, low..=high)?;
        }
        let sizes = [
            ("min_motion_m", self.min_motion_m),
            ("max_turn_rad", self.max_turn_rad),
            ("max_distance_m", self.max_distance_m),
            ("lens_std", self.lens_std),
            ("focal_std", self.focal_std),
            ("field_std", self.field_std),
            ("readout_std_s", self.readout_std_s),
            ("observable_share", self.observable_share),
            ("least_noise", self.least_noise),
        ];
        each(positive, &sizes)?;
        within("readout_s", self.readout_s, -1.0..=1.0)
    }
}
