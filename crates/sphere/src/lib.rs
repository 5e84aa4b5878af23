//! The sphere of rays on which every algorithm is written.
//!
//! A central camera is a field of unit rays eta with a brightness y(eta) and a range D(eta)
//! (thesis, section 1.2). A camera model only says which rays its pixels are; a [`SphereGrid`]
//! samples them and brings the calculus of the sphere.

pub mod camera;
pub mod lie;

pub use camera::Camera;
