//! Tests of the estimators of velocity biases in the room of the thesis's simulation.

use super::*;
use crate::{Reason, Sensor, Status};
use nalgebra::{Vector2, Vector3, Vector6};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use sphereflow_core::{Plane, RangeMap};
use sphereflow_sim::{Motion, Renderer, Scene};
use sphereflow_sphere::{Camera, SphereGrid};

mod bad_input;
mod bad_table;
mod covariance;
mod information;
mod observer;
mod scenes;
mod spikes;

/// Thesis: section 5.4.3.
const RATE_HZ: f64 = 42.0;
const ANGULAR_BIAS: Vector3<f64> = Vector3::new(0.05, 0.0, 0.0);
const LINEAR_BIAS: Vector3<f64> = Vector3::new(2.5, 0.0, 0.0);

/// Standard deviations; those of brightness and range are of 640x480, and fall by 4 at 160x120.
#[derive(Clone, Copy)]
struct Noise {
    grey: f64,
    range: f64,
    linear: f64,
    angular: f64,
}

const EXACT: Noise = Noise {
    grey: 0.0,
    range: 0.0,
    linear: 0.0,
    angular: 0.0,
};
/// Thesis: section 5.4.3.
const THESIS: Noise = Noise {
    grey: 30.0,
    range: 0.25,
    linear: 0.05,
    angular: 0.005,
};

pub(super) fn true_bias() -> Vector6<f64> {
    Vector6::new(0.05, 0.0, 0.0, 2.5, 0.0, 0.0)
}

/// 50 x 40 degrees.
pub(super) fn camera(width: usize, height: usize) -> Camera {
    let f = |n: usize, deg: f64| 0.5 * n as f64 / (0.5 * deg).to_radians().tan();
    let (cx, cy) = (0.5 * width as f64 - 0.5, 0.5 * height as f64 - 0.5);
    Camera::pinhole(f(width, 50.0), f(height, 40.0), cx, cy, width, height).unwrap()
}

/// The simulation of section 5.4.3: a hand-held camera in the painted room.
pub(super) struct Simulation {
    renderer: Renderer,
    motion: Motion,
    noise: Noise,
    rng: ChaCha8Rng,
    index: usize,
    rate_hz: f64,
}

impl Simulation {
    fn new(camera: &Camera, noise: Noise) -> Self {
        Self::painted(camera, noise, 0.5)
    }

    /// With another period of the paint, m: the fixed gains act through the images' Gram matrix, that
    /// is through the square of their slopes.
    fn painted(camera: &Camera, noise: Noise, period_m: f64) -> Self {
        let mut motion = Motion::hand_held(3);
        // A corner of the room with the floor in view.
        motion.yaw_rad.offset = 0.6;
        motion.pitch_rad.offset = -0.35;
        Self {
            renderer: Renderer::new(&Scene::thesis_room_with(period_m).unwrap(), camera),
            motion,
            noise,
            rng: ChaCha8Rng::seed_from_u64(1),
            index: 0,
            rate_hz: RATE_HZ,
        }
    }

    /// Without noise, of another scene and at another rate.
    pub(super) fn exact(camera: &Camera, scene: &Scene, rate_hz: f64) -> Self {
        Self {
            renderer: Renderer::new(scene, camera),
            rate_hz,
            ..Self::new(camera, EXACT)
        }
    }

    /// The camera turns at one place.
    pub(super) fn turn_only(&mut self) {
        for curve in &mut self.motion.position_m {
            curve.waves.clear();
        }
    }

    fn normal(&mut self, sigma: f64) -> f64 {
        let z: f64 = StandardNormal.sample(&mut self.rng);
        sigma * z
    }

    /// Images and biased velocities of the next frame, `dt_s` after the one before.
    pub(super) fn next(&mut self) -> (Plane<f32>, RangeMap, ImageVelocity, f64) {
        let dt_s = 1.0 / self.rate_hz;
        let t_s = self.index as f64 * dt_s;
        self.index += 1;
        let image = self.renderer.render(&self.motion.pose(t_s));
        let (grey, range) = (self.noise.grey / 4.0, self.noise.range / 4.0);
        let grey = if grey > 0.0 {
            image.grey.map(|g| g + self.normal(grey) as f32)
        } else {
            image.grey
        };
        let metres = image.range.into_plane();
        let range = if range > 0.0 {
            metres.map(|d| d + self.normal(range) as f32)
        } else {
            metres
        };
        // The mean over the step, as the twist that leads from pose to pose.
        let (before, now) = (self.motion.pose(t_s - dt_s), self.motion.pose(t_s));
        let twist = sphereflow_sphere::lie::motion::twist_between(&before, &now, dt_s).unwrap();
        let [a, l] = [self.noise.angular, self.noise.linear];
        let mut three =
            |sigma: f64| Vector3::new(self.normal(sigma), self.normal(sigma), self.normal(sigma));
        let velocity = ImageVelocity {
            angular_rad_s: twist.angular_rad_s + ANGULAR_BIAS + three(a),
            linear_m_s: Some(twist.linear_m_s + LINEAR_BIAS + three(l)),
        };
        (grey, RangeMap::new(range), velocity, dt_s)
    }
}

/// Errors of angular and linear bias after each frame.
fn run(config: VelocityBiasConfig, noise: Noise, seconds: f64, period_m: f64) -> Vec<(f64, f64)> {
    let camera = camera(160, 120);
    let mut simulation = Simulation::painted(&camera, noise, period_m);
    let mut estimator = VelocityBiasEstimator::new(&camera, config).unwrap();
    (0..(seconds * RATE_HZ) as usize)
        .map(|_| {
            let (grey, range, velocity, dt_s) = simulation.next();
            let state = estimator.step(&grey, &range, &velocity, dt_s).unwrap();
            let linear = state.linear_m_s.unwrap_or_default();
            (
                (state.angular_rad_s - ANGULAR_BIAS).norm(),
                (linear - LINEAR_BIAS).norm(),
            )
        })
        .collect()
}

/// Largest errors from `from_s` on.
fn largest(errors: &[(f64, f64)], from_s: f64) -> (f64, f64) {
    let from = (from_s * RATE_HZ) as usize;
    errors[from..]
        .iter()
        .fold((0.0, 0.0), |m, e| (f64::max(m.0, e.0), f64::max(m.1, e.1)))
}
