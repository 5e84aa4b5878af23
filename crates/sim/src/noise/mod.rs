//! What real sensors do to a perfect image: correlated depth noise, holes, shadows, grey-level noise.
//!
//! Every model is a pure function of its parameters, a seed and a frame index: the same three give
//! the same pixels on every machine and with any number of threads.

mod blur;
pub(crate) mod checks;
mod correlated;
mod depth;
mod distortion;
mod holes;
mod illumination;
mod image;
mod independent;
mod kinect;
mod normals;
mod rolling_shutter;
mod shadow;
pub(crate) mod stream;

#[cfg(test)]
mod image_tests;
#[cfg(test)]
mod kinect_fault_tests;
#[cfg(test)]
mod kinect_tests;

pub use correlated::CorrelationScale;
pub use depth::{DepthNoise, NoiseWorkspace};
pub use distortion::InverseDepthDistortion;
pub use illumination::Flicker;
pub use image::{ImageNoise, ImageNoiseParameters};
pub use independent::IndependentNoise;
pub use kinect::{KinectNoise, KinectParameters};
pub use rolling_shutter::RollingShutter;
