//! Tests of the attitude filters on simulated motion and on bad samples.

use super::*;
use crate::{Reason, Sensor, Status};
use nalgebra::{UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use sphereflow_core::Stamp;
use sphereflow_sphere::lie::so3;

mod bad_input;
mod bad_table;
mod invariant;
mod motion;
mod spikes;
mod visual;

const DT_S: f64 = 0.005;
const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, 9.81);
const FIELD: Vector3<f64> = Vector3::new(0.0, 20.0, -43.0);

/// A turning body in the east-north-up frame with a constant gyro bias and a little noise.
struct Body {
    rotation: UnitQuaternion<f64>,
    bias: Vector3<f64>,
    time_s: f64,
    noise: f64,
    rng: ChaCha8Rng,
}

impl Body {
    fn new(bias: [f64; 3], noise: f64) -> Self {
        Self {
            rotation: UnitQuaternion::from_euler_angles(0.4, -0.3, 1.0),
            bias: bias.into(),
            time_s: 0.0,
            noise,
            rng: ChaCha8Rng::seed_from_u64(1),
        }
    }

    fn rate(&self) -> Vector3<f64> {
        let t = self.time_s;
        Vector3::new(
            (0.7 * t).sin(),
            0.8 * (0.45 * t).cos(),
            0.6 * (0.31 * t).sin(),
        )
    }

    fn normal(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| StandardNormal.sample(&mut self.rng))
    }

    /// Turn for one step and read the sensors: gyro, specific force, field.
    fn step(&mut self, moves: bool) -> [Vector3<f64>; 3] {
        let rate = if moves { self.rate() } else { Vector3::zeros() };
        self.rotation *= so3::exp(&(rate * DT_S));
        self.time_s += DT_S;
        let gyro = rate + self.bias + self.normal() * (2e-3 * self.noise);
        let accel = self.rotation.inverse() * GRAVITY + self.normal() * (0.03 * self.noise);
        let mag = self.rotation.inverse() * FIELD + self.normal() * (0.4 * self.noise);
        [gyro, accel, mag]
    }
}

fn filter(method: Method) -> AttitudeFilter {
    AttitudeFilter::new(AttitudeConfig {
        method,
        ..AttitudeConfig::default()
    })
    .unwrap()
}
