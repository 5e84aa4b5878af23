//! Attitude from gyro, accelerometer and magnetometer, or from gyro and vision.
//!
//! The earth frame of this module is east, north (magnetic), up; [`World`] says which frame the
//! answers are given in.

mod batch;
mod bias;
mod config;
mod filter;
mod inertial;
mod invariant;
mod low_pass;
mod magnetic;
mod rest;
mod small_angle;
#[cfg(test)]
mod tests;
mod tilt;
mod visual;

pub use batch::AttitudeRun;
pub use config::{AttitudeConfig, Method, World};
pub use filter::{AttitudeFilter, AttitudeState};
pub use visual::VisualAttitude;
