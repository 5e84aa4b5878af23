//! What a self-calibration found, and what the motion let it see.

use nalgebra::DMatrix;
use sphereflow_sphere::{Camera, DepthCorrection};
use std::fmt;

/// Whether there is a calibration, and why not.
#[derive(Clone, Debug, PartialEq)]
pub enum CalibrationStatus {
    /// Something was observable; what was not is held at the prior, and listed.
    Calibrated,
    /// Nothing was: all values are those given.
    NotObservable(String),
    /// The values found do not fit the images better than those given, which are returned.
    NoImprovement(String),
}

impl CalibrationStatus {
    /// `calibrated`, `not observable` or `no improvement`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Calibrated => "calibrated",
            Self::NotObservable(_) => "not observable",
            Self::NoImprovement(_) => "no improvement",
        }
    }
}

impl fmt::Display for CalibrationStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Calibrated => f.write_str(self.name()),
            Self::NotObservable(why) | Self::NoImprovement(why) => {
                write!(f, "{}: {why}", self.name())
            }
        }
    }
}

/// One estimated number.
#[derive(Clone, Debug, PartialEq)]
pub struct CalibratedParameter {
    /// `fx`, `k1` (change of the camera's own), `relative.z1`, `additive.one`, `readout_s`.
    pub name: String,
    /// The value: a change of the camera's parameters, a coefficient, seconds.
    pub value: f64,
    /// Standard deviation, from the residuals and from leaving out each part of the recording.
    pub std: f64,
    /// Standard deviation before anything was measured.
    pub prior_std: f64,
    /// True where the motion determined it by itself; otherwise only combinations with others are
    /// known, and the prior holds the rest.
    pub observable: bool,
}

/// A combination of parameters that the motion did not show.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldCombination {
    /// Its standard deviation as a share of the prior's: 1 where nothing was seen of it.
    pub std_share: f64,
    /// The parameters with the largest shares, signed, in units of their priors.
    pub shares: Vec<(String, f64)>,
}

/// The outcome of a self-calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct SelfCalibration {
    /// Whether it is one.
    pub status: CalibrationStatus,
    /// The camera with what was found of its lens.
    pub camera: Camera,
    /// The field, in the image plane of that camera.
    pub correction: DepthCorrection,
    /// The read-out time, seconds.
    pub readout_s: f64,
    /// The numbers one by one.
    pub parameters: Vec<CalibratedParameter>,
    /// Their covariance, in the same order; empty where nothing was solved.
    pub covariance: DMatrix<f64>,
    /// What the motion did not show, the worst first.
    pub held: Vec<HeldCombination>,
    /// Median over the pairs of the domains' robust residual before, 1/m; NaN without pairs.
    pub residual_before: f64,
    /// And after.
    pub residual_after: f64,
    /// The residuals of different pairs are not independent: the standard deviations were multiplied
    /// by this, found by leaving out each part of the recording in turn.
    pub inflation: f64,
    /// Frames with a measured pose.
    pub frames: usize,
    /// Pairs that were used.
    pub pairs: usize,
    /// Gauss-Newton steps.
    pub iterations: usize,
    /// Rms of the camera's angular rate, rad/s: what a rolling shutter is seen by.
    pub rms_rate_rad_s: f64,
    /// Rms of its speed, m/s.
    pub rms_speed_m_s: f64,
}
