//! The main job: samples of a camera and its inertial sensors in; poses, map and report out.
//!
//! ```text
//! Engine::push(sample) -> front (every frame): odometry -> Update
//!                          └ keyframe -> back (after each keyframe): map, cloud
//! Engine::finish()      -> keyframes compared with each other, all poses fitted, cloud at them
//! ```
//!
//! [`Engine`] runs the stages one after the other: the same samples give the same bits, on every run
//! and with any number of threads. Stages are plain functions of [`front`] and [`back`], so that a
//! runner with threads can call the same ones.

pub mod back;
mod config;
mod engine;
pub mod front;
mod report;
mod update;
mod world;

pub use config::{EngineConfig, MapConfig, WorldChoice};
pub use engine::{Engine, Kind};
pub use report::{Report, Segment};
pub use update::Update;
pub use world::World;

pub use sphereflow_core::Result;
pub use sphereflow_solver::StopFlag;
