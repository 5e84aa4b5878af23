//! Pose graphs on rigid motions and on similarities.

#[cfg(test)]
mod duals;
mod group;
mod optimiser;
mod prior;
mod problem;
mod robust;
mod similarity;
mod solve;
#[cfg(test)]
mod tests;

pub use group::Group;
pub use optimiser::{GraphOptimiser, GraphSummary};
pub use problem::{EdgeKind, GraphIssue, PoseGraph};
pub use robust::{LoopSwitch, RobustSummary};
pub use similarity::Similarity;
