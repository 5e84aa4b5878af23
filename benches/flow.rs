//! Optical flow, variational depth and the depth filter at 640x480; one thread with
//! `RAYON_NUM_THREADS=1`.

use criterion::{Criterion, criterion_group, criterion_main};
use sphereflow_core::{Plane, Pose, Stamp};
use sphereflow_flow::{
    DataTerm, DepthFilter, DepthFilterConfig, FlowField, FlowObserver, HornSchunckConfig,
    ObserverConfig, PixelRays, SobolevConfig, SobolevDepth, TvDepth, TvDepthConfig, TvL1Config,
    TvL1Flow, horn_schunck, tv_l1,
};
use sphereflow_sim::{Motion, Renderer, Scene, SimConfig};
use std::hint::black_box;
use std::time::Duration;

type Fallible = Result<(), Box<dyn std::error::Error>>;

/// Frames of section 4.1.1 with a noise of about ten grey levels.
struct Frames {
    renderer: Renderer,
    motion: Motion,
}

const RATE_HZ: f64 = 60.0;

impl Frames {
    fn new() -> Result<Self, Box<dyn std::error::Error>> {
        let camera = SimConfig::thesis_camera(640, 480)?;
        Ok(Self {
            renderer: Renderer::new(&Scene::thesis_room(), &camera),
            motion: Motion::sinusoids_411(),
        })
    }

    fn at(&self, index: usize) -> (Plane<f32>, Pose) {
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

fn group<'a>(
    criterion: &'a mut Criterion,
    name: &str,
) -> criterion::BenchmarkGroup<'a, criterion::measurement::WallTime> {
    let mut group = criterion.benchmark_group(name);
    group.sample_size(10);
    group.measurement_time(Duration::from_secs(2));
    group.warm_up_time(Duration::from_millis(300));
    group
}

fn flow(criterion: &mut Criterion) -> Fallible {
    let frames = Frames::new()?;
    let ((a, _), (b, _)) = (frames.at(20), frames.at(21));
    let mut group = group(criterion, "flow 640x480");
    let config = HornSchunckConfig::default();
    group.bench_function("horn_schunck 50 sweeps", |bench| {
        bench.iter(|| horn_schunck(black_box(&a), &b, &config, None))
    });
    let start = tv_l1(&a, &b, &TvL1Config::default(), None)?;
    let mut warm = TvL1Flow::new(TvL1Config::warm())?;
    group.bench_function("tv_l1 warm 3x20", |bench| {
        bench.iter(|| warm.flow(black_box(&a), &b, Some(&start)))
    });
    group.bench_function("tv_l1 pyramid", |bench| {
        bench.iter(|| tv_l1(black_box(&a), &b, &TvL1Config::default(), None))
    });
    group.finish();
    Ok(())
}

fn known_motion(criterion: &mut Criterion) -> Fallible {
    let frames = Frames::new()?;
    let ((a, _), (b, _)) = (frames.at(20), frames.at(21));
    let twist = frames.motion.state(20.5 / RATE_HZ).twist;
    let rays = PixelRays::new(frames.renderer.camera())?;
    let data = DataTerm::of_pair(&rays, &a, &b, &twist, 1.0 / RATE_HZ)?;
    let mut group = group(criterion, "depth 640x480");
    let sobolev = SobolevDepth::new(&rays, SobolevConfig::default())?;
    group.bench_function("sobolev from zero to 1e-4", |bench| {
        bench.iter(|| sobolev.solve(black_box(&data), None))
    });
    let mut tv = TvDepth::new(&rays, TvDepthConfig::default())?;
    group.bench_function("tv_l1 50 iterations", |bench| {
        bench.iter(|| tv.solve(black_box(&data), None))
    });
    let mut observer = FlowObserver::new(&rays, ObserverConfig::flow())?;
    let still = FlowField::zero(640, 480);
    group.bench_function("flow observer step", |bench| {
        bench.iter(|| observer.step(black_box(&still), &twist, 1.0 / RATE_HZ))
    });
    group.finish();
    Ok(())
}

fn filter(criterion: &mut Criterion) -> Fallible {
    let frames = Frames::new()?;
    let inputs: Vec<(Plane<f32>, Pose)> = (0..60).map(|i| frames.at(i)).collect();
    let mut group = group(criterion, "depth_filter 640x480");
    for (name, binning) in [("step", 2), ("step, binned mode", 4)] {
        let config = DepthFilterConfig {
            binning,
            ..DepthFilterConfig::default()
        };
        let mut filter = DepthFilter::new(frames.renderer.camera(), config)?;
        let (mut range, mut std) = filter.range();
        let mut index = 0_usize;
        let mut next = |filter: &mut DepthFilter| {
            // To the end of the sequence and back, so that the motion never jumps.
            let place = index % 118;
            let (image, pose) = &inputs[if place < 60 { place } else { 118 - place }];
            index += 1;
            filter.step(image, pose, Stamp::from_ns(index as i64))
        };
        for _ in 0..60 {
            next(&mut filter)?;
        }
        group.bench_function(name, |bench| bench.iter(|| next(&mut filter)));
        group.bench_function(format!("{name}: range of every pixel"), |bench| {
            bench.iter(|| filter.range_into(&mut range, &mut std))
        });
    }
    group.finish();
    Ok(())
}

fn benches(criterion: &mut Criterion) {
    for part in [flow, known_motion, filter] {
        if let Err(error) = part(criterion) {
            panic!("{error}");
        }
    }
}

criterion_group!(flow_benches, benches);
criterion_main!(flow_benches);
