//! Simulated inertial, magnetic and velocity sensors: perfect readings made honest by bias and noise.

#[cfg(test)]
mod field_tests;
mod imu;
#[cfg(test)]
mod imu_tests;
mod magnetic_field;
mod magnetometer;
mod normals;
mod velocity;

pub use imu::{BodyMotion, GRAVITY_M_S2, Imu, ImuBias, ImuParameters, ImuReading};
pub use magnetic_field::{Dipole, MagneticField, MagneticFieldParameters};
pub use magnetometer::{Magnetometer, MagnetometerParameters};
pub use velocity::{VelocityParameters, VelocitySensor};
