//! Methods that the others are measured against: velocity between two depth images by the thesis's
//! own balance of D^3, and by point-wise range flow.
//!
//! For measuring, use `sphereflow_alignment::VelocityEstimator`.

mod range_flow;
pub mod thesis;

pub use range_flow::{RangeFlow, RangeFlowConfig};
pub use thesis::{RowWeights, ThesisConfig, ThesisEstimator, TimeRule};

/// Result of the crate's fallible calls: a core error names the argument, what was expected and
/// what was found. Images that cannot be used are no error but a status.
pub use sphereflow_core::Result;
