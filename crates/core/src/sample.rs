//! What a device or a recording gives, one after the other: frames and batches of inertial samples.

use crate::{ImuSample, MagSample, RgbdFrame};

/// Readings of gyro and accelerometer, stamps increasing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImuBatch {
    /// The readings.
    pub samples: Vec<ImuSample>,
}

/// One sample of any sensor, in the order of arrival.
#[derive(Clone, Debug, PartialEq)]
pub enum Sample {
    /// A frame of the camera.
    Frame(RgbdFrame),
    /// Inertial readings.
    Imu(ImuBatch),
    /// A reading of the magnetometer.
    Mag(MagSample),
}

impl From<RgbdFrame> for Sample {
    fn from(frame: RgbdFrame) -> Self {
        Self::Frame(frame)
    }
}

impl From<ImuBatch> for Sample {
    fn from(batch: ImuBatch) -> Self {
        Self::Imu(batch)
    }
}

impl From<MagSample> for Sample {
    fn from(sample: MagSample) -> Self {
        Self::Mag(sample)
    }
}
