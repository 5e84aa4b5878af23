//! Simulation: frames per second of the furnished room, with and without noise, and all round.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use sphereflow_sim::noise::{DepthNoise, ImageNoise, ImageNoiseParameters, KinectNoise};
use sphereflow_sim::noise::{KinectParameters, NoiseWorkspace};
use sphereflow_sim::sensors::ImuParameters;
use sphereflow_sim::{DepthNoiseParameters, Motion, Renderer, Scene, SimConfig, Simulator};
use sphereflow_sphere::Camera;
use std::hint::black_box;

/// Frames of the tour that each iteration runs through, so that no single view decides.
const VIEWS: usize = 25;

fn render(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("sim/render_furnished_room");
    group.throughput(Throughput::Elements(1)).sample_size(60);
    let (scene, motion) = (Scene::furnished_room(1), Motion::room_tour(1));
    let cameras = [
        (
            "640x480",
            Camera::pinhole(525.0, 525.0, 319.5, 239.5, 640, 480),
        ),
        ("360_1024x512", Camera::equirectangular(1024, 512)),
    ];
    for (name, camera) in cameras {
        let Ok(camera) = camera else { continue };
        let renderer = Renderer::new(&scene, &camera);
        let mut view = 0;
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                view = (view + 1) % VIEWS;
                black_box(renderer.render(&motion.pose(view as f64)))
            });
        });
    }
    group.finish();
}

/// What a frame of the demonstration costs, spread over its tour: rendering of range, depth, colour
/// and grey, Kinect noise, grey-level noise and inertial samples; and the same without any noise.
fn demo_frame(criterion: &mut Criterion) {
    let Ok(demo) = SimConfig::demo(1) else {
        return;
    };
    // A second between frames: as many inertial samples as at 30 Hz, from all over the tour.
    let rate_hz = VIEWS as f64 / demo.duration_s;
    let imu = demo.imu.map(|imu| ImuParameters {
        rate_hz: imu.rate_hz * rate_hz / demo.rate_hz,
        ..imu
    });
    let all_noise = SimConfig {
        rate_hz,
        imu,
        ..demo
    };
    let no_noise = SimConfig {
        depth_noise: DepthNoiseParameters::None,
        image_noise: ImageNoiseParameters::default(),
        imu: None,
        ..all_noise.clone()
    };
    let mut group = criterion.benchmark_group("sim/demo_frame_640x480");
    group.throughput(Throughput::Elements(1)).sample_size(60);
    for (name, config) in [("all_noise", all_noise), ("no_noise", no_noise)] {
        let Ok(simulator) = Simulator::new(config) else {
            continue;
        };
        let mut frames = simulator.frames();
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                let mut frame = frames.next();
                if frame.is_none() {
                    frames = simulator.frames();
                    frame = frames.next();
                }
                black_box(frame)
            });
        });
    }
    group.finish();
}

fn noise(criterion: &mut Criterion) {
    let Ok(simulator) = SimConfig::demo(1).and_then(Simulator::new) else {
        return;
    };
    let (exact, camera) = (
        simulator.exact(simulator.stamp(0)),
        simulator.renderer().camera(),
    );
    let mut group = criterion.benchmark_group("sim/noise");
    group.throughput(Throughput::Elements(1)).sample_size(60);
    if let Ok(kinect) = KinectNoise::new(KinectParameters::default(), 1) {
        let (noise, mut workspace) = (DepthNoise::Kinect(kinect), NoiseWorkspace::default());
        group.bench_function("kinect_640x480", |bencher| {
            bencher.iter(|| {
                let mut depth = exact.depth.clone();
                let applied = noise.apply_in_place(&mut depth, camera, 1, &mut workspace);
                black_box((depth, applied))
            });
        });
    }
    let grey = ImageNoiseParameters {
        sigma_grey: 2.0,
        ..ImageNoiseParameters::default()
    };
    if let Ok(noise) = ImageNoise::new(grey, 1) {
        group.bench_function("grey_levels_640x480", |bencher| {
            bencher.iter(|| {
                let mut colour = exact.colour.clone();
                noise.apply_rgb(&mut colour, simulator.stamp(0), 1);
                black_box(colour)
            });
        });
    }
    group.finish();
}

criterion_group!(benches, render, demo_frame, noise);
criterion_main!(benches);
