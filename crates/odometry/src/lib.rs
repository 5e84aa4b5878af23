//! Velocity and trajectory of a camera from its depth images: the geometric flow of Chapter 6.
//!
//! [`estimate_velocity`] measures the velocity between two depth images, [`VelocityEstimator`] does
//! so again and again without allocating, and [`DepthOdometry`] chains the measurements into a
//! trajectory. All of them work on the sphere of rays, so any central camera will do. Twists are
//! `[omega, v]` in the camera's own frame (x right, y down, z forward).

mod align;
mod binning;
mod brightness;
mod config;
mod depth_image;
mod direction_name;
mod dissent;
mod error;
mod estimate;
mod graph;
mod information;
mod inside;
mod keyframe;
mod motion;
mod noise_model;
mod observability;
mod odometry;
mod optimise;
mod plane_projection;
mod pose_graph;
mod pyramid;
mod range_flow;
mod robust;
mod row_motion;
mod self_calibration;
mod sphere_table;
pub mod thesis;
mod tiling;
mod warp;
mod weak_form;

pub use config::{Config, CovarianceModel, Method, REFERENCE_WIDTH};
pub use depth_image::DepthImage;
pub use direction_name::{DirectionName, direction_name};
pub use error::Error;
pub use estimate::{Also, VelocityEstimate, VelocityEstimator, VelocityPrior, estimate_velocity};
pub use graph::GraphConfig;
pub use information::{Information, information};
pub use keyframe::{KeyframeMotion, KeyframePolicy};
pub use motion::{pose_from_twist, twist_from_pose};
pub use noise_model::NoiseModel;
pub use observability::WeakDirection;
pub use odometry::{DepthOdometry, Gyro, OdometryConfig, OdometryResult, Timings};
pub use optimise::OptimiseReport;
pub use range_flow::{RangeFlow, RangeFlowConfig};
pub use self_calibration::{
    CalibratedParameter, CalibrationStatus, HeldCombination, SelfCalibration,
    SelfCalibrationConfig, SelfCalibrator,
};
pub use thesis::{RowWeights, ThesisConfig, ThesisEstimator, TimeRule};

/// Result of the crate's fallible calls.
pub type Result<T> = std::result::Result<T, Error>;
