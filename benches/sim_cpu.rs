//! Simulation: processor time of a demo frame by stage, all threads together, whatever else runs.
//! `cargo bench --bench sim_cpu` prints it; Linux only, elsewhere it says so.

use sphereflow_sim::noise::{
    DepthNoise, ImageNoise, KinectNoise, KinectParameters, NoiseWorkspace,
};
use sphereflow_sim::{SimConfig, Simulator};
use std::hint::black_box;

/// Frames averaged, spread over the whole tour, so that no single view decides.
const FRAMES: usize = 150;

/// Nanoseconds of all threads of this process on a processor so far.
fn cpu_ns() -> Option<u64> {
    let mut sum = 0;
    for task in std::fs::read_dir("/proc/self/task").ok()? {
        let text = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
        sum += text.split_whitespace().next()?.parse::<u64>().ok()?;
    }
    Some(sum)
}

fn stage(name: &str, mut work: impl FnMut(usize)) {
    work(0);
    let start = cpu_ns();
    for k in 0..FRAMES {
        work(k);
    }
    match (start, cpu_ns()) {
        (Some(from), Some(to)) => {
            let ms = (to - from) as f64 / FRAMES as f64 / 1e6;
            println!("cpu {name:<24} {ms:6.2} ms/frame");
        }
        _ => println!("cpu {name}: no processor times on this system"),
    }
}

fn main() {
    let demo = SimConfig::demo(1).expect("the demonstration is valid");
    let rate_hz = FRAMES as f64 / demo.duration_s;
    let config = SimConfig { rate_hz, ..demo };
    let (grey, seed) = (config.image_noise, config.seed);
    let simulator = Simulator::new(config).expect("the demonstration is valid");
    let camera = simulator.renderer().camera();
    stage("render", |k| {
        black_box(simulator.exact(simulator.stamp(k)));
    });
    let exact = simulator.exact(simulator.stamp(0));
    stage("copy of depth", |_| {
        black_box(exact.depth.clone());
    });
    let kinect = KinectNoise::new(KinectParameters::default(), seed).expect("valid");
    let (kinect, mut workspace) = (DepthNoise::Kinect(kinect), NoiseWorkspace::default());
    stage("kinect noise (with copy)", |k| {
        let mut depth = exact.depth.clone();
        let result = kinect.apply_in_place(&mut depth, camera, k as u64, &mut workspace);
        black_box((depth, result)).1.expect("the camera fits");
    });
    let image = ImageNoise::new(grey, seed).expect("valid");
    stage("image noise (with copy)", |k| {
        let mut colour = exact.colour.clone();
        image.apply_rgb(&mut colour, simulator.stamp(k), k as u64);
        black_box(colour);
    });
    let mut frames = simulator.frames();
    stage("whole frame", |_| {
        black_box(frames.next());
    });
}
