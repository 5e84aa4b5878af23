//! Seeded problems with a known truth: rooms, streets, and graphs on spheres, tori and grids.

mod graphs;
mod random;
mod scene;

pub use graphs::{Graph, GraphKind, GraphSettings, graph};
#[cfg(test)]
pub(crate) use random::Random;
pub use scene::{Scene, SceneKind, SceneSettings, scene};
