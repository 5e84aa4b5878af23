//! What the benches of flow and depth run on: frames of the room of section 4.1.1, and their settings.

use criterion::Criterion;
use sphereflow_core::{Plane, Pose};
use sphereflow_sim::{Motion, Renderer, Scene, SimConfig};
use std::time::Duration;

pub type Fallible = Result<(), Box<dyn std::error::Error>>;

/// Frames of section 4.1.1 with a noise of about ten grey levels.
pub struct Frames {
    pub renderer: Renderer,
    pub motion: Motion,
}

pub const RATE_HZ: f64 = 60.0;

impl Frames {
    pub fn new() -> Result<Self, Box<dyn std::error::Error>> {
        let camera = SimConfig::thesis_camera(640, 480)?;
        Ok(Self {
            renderer: Renderer::new(&Scene::thesis_room(), &camera),
            motion: Motion::sinusoids_411(),
        })
    }

    pub fn at(&self, index: usize) -> (Plane<f32>, Pose) {
        let pose = self.motion.pose(index as f64 / RATE_HZ);
        let mut image = self.renderer.render(&pose).grey_1_to_256();
        // A cheap noise, the same in every run: a multiplicative hash of the pixel and the frame.
        for (i, value) in image.data_mut().iter_mut().enumerate() {
            let hash = (i as u32 ^ (index as u32) << 20).wrapping_mul(2_654_435_761) >> 8;
            *value += (hash as f32 / (1 << 24) as f32 - 0.5) * 34.0;
        }
        (image, pose)
    }
}

/// Ten samples: a step takes milliseconds.
pub fn group<'a>(
    criterion: &'a mut Criterion,
    name: &str,
) -> criterion::BenchmarkGroup<'a, criterion::measurement::WallTime> {
    let mut group = criterion.benchmark_group(name);
    group.sample_size(10);
    group.measurement_time(Duration::from_secs(2));
    group.warm_up_time(Duration::from_millis(300));
    group
}
