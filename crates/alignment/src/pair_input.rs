//! The arguments that all estimators of a pair have in common.

use crate::Result;
use crate::depth_image::DepthImage;
use sphereflow_core::{Error, checks};
use sphereflow_sphere::Camera;

/// Two depth images of one camera and the time between them, checked.
#[derive(Clone, Copy, Debug)]
pub struct PairInput<'a> {
    /// The earlier image.
    pub first: DepthImage<'a>,
    /// The later image.
    pub second: DepthImage<'a>,
    /// Time between them, seconds.
    pub dt_s: f64,
}

impl<'a> PairInput<'a> {
    /// The arguments `depth0`, `depth1` and `dt_s` of an estimator for images of `camera`.
    ///
    /// # Errors
    /// A value error where `dt_s` is not positive, a shape error where an image is not of the
    /// camera's size.
    pub fn checked(
        camera: &Camera,
        first: impl Into<DepthImage<'a>>,
        second: impl Into<DepthImage<'a>>,
        dt_s: f64,
    ) -> Result<Self> {
        checks::positive("dt_s", dt_s)?;
        let (first, second) = (first.into(), second.into());
        let size = (camera.width(), camera.height());
        check_size("depth0", &first, size)?;
        check_size("depth1", &second, size)?;
        Ok(Self {
            first,
            second,
            dt_s,
        })
    }
}

/// # Errors
/// A shape error where an image is not of the camera's size.
pub(crate) fn check_size(
    argument: &str,
    image: &DepthImage<'_>,
    (width, height): (usize, usize),
) -> Result<()> {
    let (w, h) = image.size();
    if (w, h) == (width, height) {
        return Ok(());
    }
    let expected = format!("{width}x{height} pixels as the camera");
    Err(Error::shape(argument, expected, format!("{w}x{h} pixels")))
}
