//! Velocity from two 640x480 depth images, and a frame of the voxel cloud.

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{Vector2, Vector3};
use sphereflow_alignment::{Config, Method, VelocityEstimator, pose_from_twist};
use sphereflow_core::{DepthMap, Plane, Pose, Stamp, Twist};
use sphereflow_odometry::{DepthOdometry, OdometryConfig};
use sphereflow_slam::VoxelCloud;
use sphereflow_sphere::Camera;
use std::hint::black_box;

const DT_S: f64 = 1.0 / 30.0;

fn camera() -> Camera {
    Camera::pinhole(525.0, 525.0, 319.5, 239.5, 640, 480).expect("a valid camera")
}

fn motion() -> Twist {
    Twist::from_vector(&[0.3, -0.4, 0.2, 0.25, -0.1, 0.3].into())
}

/// Exact depth of a corner of three slanted walls after `time_s` seconds of motion.
fn view(camera: &Camera, time_s: f64) -> DepthMap {
    let walls = [
        ([0.5, 0.1, 1.0], 3.0),
        ([-0.7, 0.2, 1.0], 2.8),
        ([0.1, 0.9, 0.6], 2.0),
    ]
    .map(|(n, d)| (Vector3::from(n).normalize(), d));
    let pose = pose_from_twist(&motion(), time_s);
    DepthMap::new(Plane::from_fn(640, 480, |x, y| {
        let ray = camera
            .unproject(&Vector2::new(x as f64, y as f64))
            .expect("a pinhole has rays");
        let towards = pose.rotation * ray;
        let range = walls
            .iter()
            .map(|(n, d)| (d - n.dot(&pose.translation)) / n.dot(&towards))
            .filter(|t| *t > 0.0)
            .fold(f64::NAN, f64::min);
        (range * ray.z) as f32
    }))
}

fn velocity(c: &mut Criterion) {
    let camera = camera();
    let (a, b) = (view(&camera, 0.0), view(&camera, DT_S));
    for (name, method) in [("single", Method::Single), ("pyramid", Method::Pyramid)] {
        let mut estimator =
            VelocityEstimator::new(&camera, Config::of(method)).expect("valid settings");
        c.bench_function(&format!("estimate_velocity 640x480, {name}"), |bench| {
            bench.iter(|| estimator.estimate(black_box(&a), black_box(&b), DT_S))
        });
    }
    for (name, readout_s) in [("global shutter", 0.0), ("rolling shutter", 0.03)] {
        let config = OdometryConfig {
            readout_s,
            ..OdometryConfig::default()
        };
        let views: Vec<DepthMap> = (0..8).map(|i| view(&camera, 0.01 * f64::from(i))).collect();
        let mut odometry = DepthOdometry::new(&camera, config).expect("valid settings");
        let mut frame = 0_i64;
        c.bench_function(&format!("DepthOdometry::push 640x480, {name}"), |bench| {
            bench.iter(|| {
                frame += 1;
                // to and fro, so that no two images in a row are the same
                let place = (frame % 14 - 7).unsigned_abs() as usize;
                odometry.push(black_box(&views[place]), Stamp::from_ns(frame * 33_333_333))
            })
        });
    }
}

/// Thesis: Table 6.1: 6.5 ms for 40 domains, 76.6 ms for 1000. One pass over the image sums all
/// domains of a tiling, so that their number hardly matters.
fn domains(c: &mut Criterion) {
    let camera = camera();
    let (a, b) = (view(&camera, 0.0), view(&camera, DT_S));
    for domains in [40, 100, 200, 500, 1000] {
        let config = Config {
            domains,
            min_domains: 20,
            ..Config::of(Method::Single)
        };
        let mut estimator = VelocityEstimator::new(&camera, config).expect("valid settings");
        c.bench_function(&format!("Table 6.1, {domains} domains"), |bench| {
            bench.iter(|| estimator.estimate(black_box(&a), black_box(&b), DT_S))
        });
    }
}

fn cloud(c: &mut Criterion) {
    let camera = camera();
    let depth = view(&camera, 0.0);
    let colour = Plane::filled(640, 480, [90, 120, 200]);
    let mut cloud = VoxelCloud::new(0.02, 1_000_000).expect("valid settings");
    c.bench_function("VoxelCloud::add 640x480, stride 4", |bench| {
        bench.iter(|| {
            cloud.add(
                black_box(&depth),
                Some(&colour),
                &camera,
                &Pose::identity(),
                4,
                8.0,
            )
        })
    });
}

criterion_group!(benches, velocity, domains, cloud);
criterion_main!(benches);
