//! Bundle adjustment: poses, points and intrinsics from pixels and depths. Thesis: section 8.4.2.

mod active;
mod adjuster;
mod assembly;
mod chunk;
mod components;
mod covariance;
mod device;
mod ids;
mod inertial;
mod intrinsics;
mod issue;
mod kernel;
mod layout;
mod marginal;
mod measurement;
mod normal;
mod plan;
mod prior;
mod problem;
mod relative;
mod reverse;
mod rows;
mod sighting;
mod state;
mod step;

#[cfg(test)]
mod tests;

pub(crate) use prior::root_information;

pub use adjuster::{BundleAdjuster, BundleSummary, adjust};
pub use device::DeviceCalibration;
pub use inertial::Motion;
pub use issue::Issue;
pub use problem::{BundleProblem, Losses, ReadDepth};
pub use rows::RowMotion;
