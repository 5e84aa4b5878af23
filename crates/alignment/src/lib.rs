//! Motion between two depth images of one camera: the geometric flow of Chapter 6.
//!
//! [`estimate_velocity`] measures the velocity between two depth images, [`VelocityEstimator`] does
//! so again and again without allocating. [`Aligner`] is the step below: it aligns any frame to any
//! stored one, as [`FramePyramid`]s, from any first guess; odometry and maps are built on it. All of
//! them work on the sphere of rays, so any central camera will do. Twists are `[omega, v]` in the
//! camera's own frame (x right, y down, z forward).
//!
//! The modules are the parts of the method, for estimators that share some of them.

mod align;
pub mod area_integrals;
pub mod binning;
mod brightness;
mod cell_sums;
mod config;
mod depth_image;
mod direction_name;
mod estimate;
mod information;
mod motion;
mod noise_model;
pub mod observability;
mod pair;
mod pair_input;
mod plane_projection;
mod pyramid;
mod robust;
pub mod row_motion;
mod rows;
mod second_motion;
pub mod sphere_table;
pub mod tiling;
pub mod warp;
pub mod weak_form;

pub use align::{Aligner, Alignment, MotionPrior, Priors, ReadOut};
pub use brightness::BrightnessPyramid;
pub use cell_sums::CellSums;
pub use config::{Config, CovarianceModel, Method, REFERENCE_WIDTH};
pub use depth_image::{Axis, DepthImage};
pub use direction_name::{DirectionName, direction_name};
pub use estimate::{Also, VelocityEstimate, VelocityEstimator, VelocityPrior, estimate_velocity};
pub use information::{Information, information};
pub use motion::{pose_from_twist, twist_from_pose};
pub use noise_model::NoiseModel;
pub use observability::WeakDirection;
pub use pair::Pair;
pub use pair_input::PairInput;
pub use plane_projection::PlaneProjection;
pub use pyramid::FramePyramid;
pub use second_motion::SecondMotion;

/// Result of the crate's fallible calls: a core error names the argument, what was expected and
/// what was found. A frame that cannot be used is no error but a status.
pub use sphereflow_core::Result;
