//! Calibration from recordings: each says whether the recording excites what it estimates.

mod camera_imu;
mod mag_ellipsoid;
mod still;
#[cfg(test)]
mod tests;

pub use camera_imu::{CameraImu, camera_imu};
pub use mag_ellipsoid::{MagEllipsoid, mag_ellipsoid};
pub use still::{ImuStill, imu_still};

use crate::Result;
use nalgebra::Vector3;
use sphereflow_core::{Error, Stamp};

/// Lengths agree, stamps increase, numbers are finite.
fn check(name: &str, stamps: &[Stamp], values: &[Vector3<f64>], needed: usize) -> Result<()> {
    if values.len() != stamps.len() || values.len() < needed {
        let expected = format!("({}, 3), at least {needed} rows", stamps.len());
        return Err(Error::shape(name, expected, format!("({}, 3)", values.len())).into());
    }
    for (i, pair) in stamps.windows(2).enumerate() {
        if pair[1] <= pair[0] {
            return Err(Error::TimeOrder {
                argument: "stamp_ns".into(),
                earlier: pair[0],
                later: pair[1],
                index: i + 1,
            }
            .into());
        }
    }
    if let Some(i) = values.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
        let found = format!("{:?}", values[i].as_slice());
        return Err(Error::value(format!("{name}[{i}]"), "finite numbers", found).into());
    }
    Ok(())
}
