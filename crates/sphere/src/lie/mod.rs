//! The groups of rotations and rigid motions: exponentials, logarithms, derivatives, integration.
//!
//! Rotations are `target_from_source` unit quaternions (Hamilton: `x_target = q x_source q*`), rigid
//! motions are [`sphereflow_core::Pose`]; tangent vectors are rotation vectors in radians, and
//! twists `[omega, v]`, angular part first, in the source (body) frame. Numbers that are not
//! finite come out as NaN.

pub mod bortz;
pub mod euler;
pub mod motion;
pub mod quaternion;
pub mod se3;
mod series;
pub mod so3;
#[cfg(test)]
mod tests;

pub use euler::Euler;
