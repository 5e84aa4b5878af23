//! Simulated rooms, cameras and inertial sensors with honest noise; deterministic by seed.
//!
//! The world has x right, y down, z forward: gravity is (0, +9.81, 0). A [`Scene`] is a few dozen
//! solids painted with textures, a [`Motion`] a camera path with exact derivatives, a [`Renderer`]
//! what a camera sees of the scene from a pose, [`noise`] and [`sensors`] what real devices make of
//! it, and a [`Simulator`] all of them together: a recording that never happened. [`problems`] are
//! least-squares problems of known truth for the solver.

pub mod motion;
pub mod noise;
pub mod problems;
pub mod render;
pub mod scene;
pub mod sensors;
pub mod simulator;

mod error;
mod rounding;

pub use error::{Error, Result};
pub use motion::{Motion, MotionState};
pub use render::{Rendered, Renderer, render};
pub use scene::{Hit, Scene};
pub use simulator::{DepthNoiseParameters, MagConfig, SimConfig, SimulatedFrame, Simulator};
