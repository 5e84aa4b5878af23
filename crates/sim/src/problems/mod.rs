//! Seeded problems of the solver with a known truth: rooms, streets, and graphs on spheres, tori and grids.

mod graphs;
mod random;
mod scene;

pub use graphs::{Graph, GraphKind, GraphSettings, graph};
pub use random::Random;
pub use scene::{Scene, SceneKind, SceneSettings, scene};
