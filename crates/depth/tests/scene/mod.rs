//! The sequence of section 4.1.1: images with noise, exact ranges, velocities and poses.
#![allow(dead_code)] // every test file uses another part

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use sphereflow_core::{Plane, Pose, Twist};
use sphereflow_sim::{Motion, Renderer, Scene, SimConfig};
use sphereflow_sphere::Camera;

/// A scene, a camera and a motion at a frame rate.
pub struct Sequence {
    pub renderer: Renderer,
    pub motion: Motion,
    pub rate_hz: f64,
    pub sigma: f64,
    pub seed: u64,
}

/// One image with what is true of it.
pub struct Frame {
    pub image: Plane<f32>,
    pub range: Plane<f32>,
    pub pose: Pose,
    pub t_s: f64,
}

impl Sequence {
    /// Thesis: section 4.1.1. The room at `width` x `height`, 60 Hz, grey noise `sigma`.
    pub fn room(width: usize, height: usize, sigma: f64) -> Self {
        let camera = SimConfig::thesis_camera(width, height).unwrap();
        Self::new(
            Scene::thesis_room(),
            &camera,
            Motion::sinusoids_411(),
            sigma,
        )
    }

    pub fn new(scene: Scene, camera: &Camera, motion: Motion, sigma: f64) -> Self {
        Self {
            renderer: Renderer::new(&scene, camera),
            motion,
            rate_hz: 60.0,
            sigma,
            seed: 1,
        }
    }

    pub fn camera(&self) -> &Camera {
        self.renderer.camera()
    }

    pub fn dt_s(&self) -> f64 {
        1.0 / self.rate_hz
    }

    /// Frame `index`.
    pub fn frame(&self, index: usize) -> Frame {
        let t_s = index as f64 * self.dt_s();
        let pose = self.motion.pose(t_s);
        let rendered = self.renderer.render(&pose);
        let mut image = rendered.grey_1_to_256();
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed * 1_000_003 + index as u64);
        if self.sigma > 0.0 {
            let noise = Normal::new(0.0, self.sigma as f32).unwrap();
            for value in image.data_mut() {
                *value += noise.sample(&mut rng);
            }
        }
        Frame {
            image,
            range: rendered.range.into_plane(),
            pose,
            t_s,
        }
    }

    /// Velocities `steps` frames (or parts of one) after the start.
    pub fn twist(&self, steps: f64) -> Twist {
        self.motion.state(steps * self.dt_s()).twist
    }
}

/// Thesis: section 4.1.1. The global relative error E, percent, over the pixels of known truth;
/// weighted by solid angle for a 360-degree image.
pub fn error_percent(range: &Plane<f32>, truth: &Plane<f32>, camera: &Camera) -> f64 {
    let (width, height) = truth.size();
    let (mut sum, mut weights) = (0.0, 0.0);
    for y in 0..height {
        let weight = if camera.wraps_around() {
            ((y as f64 + 0.5) / height as f64 * std::f64::consts::PI).sin()
        } else {
            1.0
        };
        for x in 0..width {
            let (found, expected) = (f64::from(range[(x, y)]), f64::from(truth[(x, y)]));
            if expected.is_finite() {
                assert!(found.is_finite(), "unknown at ({x}, {y})");
                sum += weight * (found - expected).abs() / expected;
                weights += weight;
            }
        }
    }
    100.0 * sum / weights
}

/// `v` sorted, and its value at a share of it.
pub fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[((sorted.len() - 1) as f64 * share) as usize]
}
