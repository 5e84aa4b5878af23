//! Tests of the groups: there and back, derivatives against differences, conventions, errata.

mod bortz;
mod conventions;
mod euler;
mod se3;
mod so3;

use nalgebra::{UnitQuaternion, Vector3, Vector6};
use proptest::prelude::*;
use std::f64::consts::PI;

/// Angles from rounding to the half turn.
const ANGLES: [f64; 16] = [
    0.0,
    1e-300,
    1e-160,
    1e-12,
    1e-8,
    1e-5,
    9e-5,
    2.1e-4,
    1e-3,
    0.3,
    0.999_999_9,
    1.000_000_1,
    2.0,
    3.0,
    PI - 1e-9,
    PI,
];

/// Some unit axes.
fn axes() -> [Vector3<f64>; 4] {
    [
        Vector3::x(),
        -Vector3::z(),
        Vector3::new(0.36, -0.48, 0.8),
        Vector3::new(-1.0, -2.0, 0.5).normalize(),
    ]
}

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-size..size).prop_map(Vector3::from)
}

fn twist(angular: f64, linear: f64) -> impl Strategy<Value = Vector6<f64>> {
    (vector(angular), vector(linear)).prop_map(|(w, v)| Vector6::new(w.x, w.y, w.z, v.x, v.y, v.z))
}

fn attitude() -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(0.4, -1.1, 2.3)
}
