//! Simulated rooms, cameras and inertial sensors with honest noise; deterministic by seed.

pub mod noise;
pub mod sensors;
