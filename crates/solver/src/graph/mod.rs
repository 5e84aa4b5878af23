//! Pose graphs on rigid motions and on similarities.

#[cfg(test)]
mod duals;
mod group;
mod prior;
mod problem;
mod robust;
mod similarity;
mod solve;
#[cfg(test)]
mod tests;

pub use group::Group;
pub use problem::{EdgeKind, GraphIssue, PoseGraph};
pub use robust::{LoopSwitch, RobustSummary};
pub use similarity::Similarity;
pub use solve::GraphSummary;
