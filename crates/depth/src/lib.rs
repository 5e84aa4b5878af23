//! Dense depth from images whose motion is known (Chapters 2 to 4).
//!
//! With a known motion the optical flow has one unknown left, the range: [`SobolevDepth`] and [`TvDepth`]
//! find its inverse from two images of any camera, [`FlowObserver`] and [`DepthObserver`] follow it over
//! time, and [`DepthFilter`] is the best of all. Images are planes of brightness of any scale (settings
//! are for 1 to 256); ranges are along the ray, in metres.

mod data_term;
mod elliptic;
mod filter;
mod observer;
mod rays;
mod sobolev;
mod status;
mod tv_depth;
mod variational;

pub use data_term::DataTerm;
pub use filter::{Brightness, DepthFilter, DepthFilterConfig, DepthStep, PoseNoise, VelocityNoise};
pub use observer::{DepthObserver, FlowObserver, ObserverConfig};
pub use rays::{MotionField, PixelRays};
pub use sobolev::{SobolevConfig, SobolevDepth};
pub use status::{DepthReason, DepthStatus};
pub use tv_depth::{TvDepth, TvDepthConfig};
pub use variational::VariationalDepth;

pub use sphereflow_core::{Error, Result};
