//! Seeded problems with a known truth: rooms, streets, and graphs on spheres, tori and grids.

mod random;
mod scene;

#[cfg(test)]
pub(crate) use random::Random;
pub use scene::{Scene, SceneKind, SceneSettings, scene};
