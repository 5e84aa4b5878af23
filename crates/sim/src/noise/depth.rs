//! The choice of a depth noise, and what all depth noises share.

use super::correlated::CorrelatedField;
use super::distortion::FactorField;
use super::shadow::Shadow;
use super::{IndependentNoise, KinectNoise};
use sphereflow_core::{DepthMap, Error, Plane, Result};
use sphereflow_sphere::camera::Camera;

/// Which noise a simulated depth camera has.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum DepthNoise {
    /// Perfect depth.
    #[default]
    None,
    /// Each pixel for itself.
    Independent(IndependentNoise),
    /// Structured light with all its faults.
    Kinect(KinectNoise),
}

impl DepthNoise {
    /// What the sensor reads of `depth` in frame `frame_index`. Unknown pixels stay unknown.
    ///
    /// # Errors
    /// [`Error::Shape`] where the map is not of the camera's size, [`Error::Value`] for a camera
    /// that the model does not fit.
    pub fn apply(&self, depth: &DepthMap, camera: &Camera, frame_index: u64) -> Result<DepthMap> {
        let mut noisy = depth.clone();
        let mut workspace = NoiseWorkspace::default();
        self.apply_in_place(&mut noisy, camera, frame_index, &mut workspace)?;
        Ok(noisy)
    }

    /// [`DepthNoise::apply`] without a new image; allocates only where `workspace` has not yet seen
    /// this camera.
    ///
    /// # Errors
    /// As [`DepthNoise::apply`]; the map is then unchanged.
    pub fn apply_in_place(
        &self,
        depth: &mut DepthMap,
        camera: &Camera,
        frame_index: u64,
        workspace: &mut NoiseWorkspace,
    ) -> Result<()> {
        match self {
            Self::None => check_size(depth, camera),
            Self::Independent(noise) => {
                check_size(depth, camera)?;
                noise.apply_in_place(depth, frame_index);
                Ok(())
            }
            Self::Kinect(noise) => noise.apply_in_place(depth, camera, frame_index, workspace),
        }
    }
}

/// Buffers kept from frame to frame. They hold no state: any workspace gives the same result.
#[derive(Clone, Debug, Default)]
pub struct NoiseWorkspace {
    pub(crate) correlated: CorrelatedField,
    pub(crate) factors: FactorField,
    pub(crate) shadow: Shadow,
}

#[cfg(test)]
impl NoiseWorkspace {
    /// Where the buffers lie: equal before and after where nothing was allocated anew.
    pub(crate) fn addresses(&self) -> [*const f32; 6] {
        let [a, b, c, d] = self.correlated.addresses();
        [a, b, c, d, self.factors.address(), self.shadow.address()]
    }
}

/// # Errors
/// [`Error::Shape`] where the map is not of the camera's size.
pub(crate) fn check_size(depth: &DepthMap, camera: &Camera) -> Result<()> {
    let (width, height) = depth.size();
    if (width, height) == (camera.width(), camera.height()) {
        return Ok(());
    }
    Err(Error::shape(
        "depth",
        format!("{}x{} as the camera", camera.width(), camera.height()),
        format!("{width}x{height}"),
    ))
}

/// Lets `change` write the metres of a map in place.
pub(crate) fn edit(depth: &mut DepthMap, change: impl FnOnce(&mut [f32])) {
    let empty = DepthMap::new(Plane::filled(0, 0, 0.0));
    let mut plane = std::mem::replace(depth, empty).into_plane();
    change(plane.data_mut());
    *depth = DepthMap::new(plane);
}
