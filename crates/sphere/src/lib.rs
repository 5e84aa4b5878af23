//! The sphere of rays on which every algorithm is written.
//!
//! A central camera is a field of unit rays eta with a brightness y(eta) and a range D(eta)
//! (thesis, section 1.2). A camera model only says which rays its pixels are; a [`SphereGrid`]
//! samples them and brings the calculus of the sphere.

mod calibration;
pub mod camera;
pub mod depth_correction;
mod grid;
pub mod lie;
mod range;
mod rolling_shutter;
pub mod sampling;
mod warp;

pub use calibration::Calibration;
pub use camera::Camera;
pub use depth_correction::{DepthCorrection, DepthCorrector};
pub use grid::{Border, Edge, SphereGrid, laplacian_discrepancy};
pub use range::{depth_from_range, range_from_depth};
pub use rolling_shutter::{RollingShutter, row_time_s};
pub use sampling::{Sampler, catmull_rom};
pub use warp::Warp;
