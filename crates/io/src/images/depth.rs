//! Depth in counts, as files store it, and in metres.

use crate::Result;
use sphereflow_core::{DepthMap, Error as CoreError, Plane, RangeMap};

/// Counts that mean "no reading": 0 by the habit of TUM and Kinect, 65535 by that of 7-Scenes.
const UNKNOWN: [u16; 2] = [0, u16::MAX];

/// An error unless `depth_scale` is a positive number of counts per metre.
pub(crate) fn check_scale(depth_scale: f64) -> std::result::Result<(), CoreError> {
    if depth_scale.is_finite() && depth_scale > 0.0 {
        return Ok(());
    }
    let expected = "a positive number of counts per metre";
    Err(CoreError::value("depth_scale", expected, depth_scale))
}

/// Metres from counts: `counts / depth_scale`; 0 and 65535 are unknown (NaN).
///
/// # Errors
/// [`crate::Error::Core`] where `depth_scale` is not positive.
pub fn depth_from_raw(raw: &Plane<u16>, depth_scale: f64) -> Result<DepthMap> {
    Ok(DepthMap::new(metres_from_raw(raw, depth_scale)?))
}

/// [`depth_from_raw`] for images that hold ranges along the rays: those of 360-degree cameras.
///
/// # Errors
/// As [`depth_from_raw`].
pub fn range_from_raw(raw: &Plane<u16>, depth_scale: f64) -> Result<RangeMap> {
    Ok(RangeMap::new(metres_from_raw(raw, depth_scale)?))
}

fn metres_from_raw(raw: &Plane<u16>, depth_scale: f64) -> Result<Plane<f32>> {
    check_scale(depth_scale)?;
    let scale = depth_scale as f32;
    Ok(raw.map(|&counts| {
        if UNKNOWN.contains(&counts) {
            f32::NAN
        } else {
            f32::from(counts) / scale
        }
    }))
}

/// Counts from metres, rounded to the nearest; unknown depth, and depth that would need 65535
/// counts or more or less than half a count, is 0.
///
/// # Errors
/// [`crate::Error::Core`] where `depth_scale` is not positive.
pub fn raw_from_depth(depth: &DepthMap, depth_scale: f64) -> Result<Plane<u16>> {
    raw_from_metres(depth.metres(), depth_scale)
}

/// [`raw_from_depth`] of metres along whatever.
///
/// # Errors
/// As [`raw_from_depth`].
pub(crate) fn raw_from_metres(metres: &Plane<f32>, depth_scale: f64) -> Result<Plane<u16>> {
    check_scale(depth_scale)?;
    let scale = depth_scale as f32;
    Ok(metres.map(|&metres| {
        let counts = (metres * scale).round();
        // NaN compares false and becomes 0 as well.
        if counts < f32::from(u16::MAX) {
            counts as u16
        } else {
            0
        }
    }))
}
