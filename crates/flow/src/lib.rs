//! What a moving camera sees flow, and how far away it therefore is (Chapters 2 to 4).
//!
//! [`horn_schunck`] and [`tv_l1`] measure the optical flow between two images, [`rof_denoise`]
//! smooths one. With a known motion the flow has one unknown left, the range: [`SobolevDepth`] and
//! [`TvDepth`] find its inverse for any camera, [`FlowObserver`] and
//! [`DepthObserver`] follow it over time, and [`DepthFilter`] is the best of all. Images are planes of brightness of any scale (settings
//! are for 1 to 256); flow is in pixels, columns to the right and rows down.

mod blank;
mod data_term;
mod derivatives;
mod elliptic;
mod error;
mod field;
mod filter;
mod gaussian;
mod horn_schunck;
mod noise;
mod observer;
mod padded;
mod rays;
mod rof;
mod sampling;
mod sobolev;
mod status;
mod sweeping;
mod tv_depth;
mod tv_l1;

pub use data_term::DataTerm;
pub use derivatives::{Derivatives, sobel};
pub use error::Error;
pub use field::FlowField;
pub use filter::{Brightness, DepthFilter, DepthFilterConfig, DepthStep, PoseNoise, VelocityNoise};
pub use horn_schunck::{
    HornSchunckConfig, HornSchunckSolver, horn_schunck, horn_schunck_energy, horn_schunck_of,
};
pub use observer::{DepthObserver, FlowObserver, ObserverConfig};
pub use rays::{MotionField, PixelRays};
pub use rof::{RofConfig, rof_denoise, rof_energy};
pub use sobolev::{SobolevConfig, SobolevDepth, VariationalDepth};
pub use status::{DepthReason, DepthStatus};
pub use tv_depth::{TvDepth, TvDepthConfig};
pub use tv_l1::{TvL1Config, TvL1Flow, tv_l1};

/// Result of the crate's fallible calls.
pub type Result<T> = std::result::Result<T, Error>;
