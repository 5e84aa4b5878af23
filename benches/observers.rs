//! A step of the attitude filter, an inertial reading of the navigation filter, a pair of images of
//! the information form: all on sensors that move, as they do in use.

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use sphereflow_core::{ImuSample, Plane, RangeMap, Stamp};
use sphereflow_observers::attitude::{AttitudeConfig, AttitudeFilter, Method};
use sphereflow_observers::imu_bias::{ImuBiasConfig, ImuBiasEstimator};
use sphereflow_observers::navigation::{NavigationConfig, NavigationFilter};
use sphereflow_observers::velocity_bias::{
    ImageVelocity, VelocityBiasConfig, VelocityBiasEstimator,
};
use sphereflow_sim::{Motion, Renderer, Scene};
use sphereflow_sphere::Camera;
use sphereflow_sphere::lie::motion::twist_between;
use std::cell::LazyCell;
use std::f64::consts::TAU;
use std::hint::black_box;

/// Readings of a body that sways, one period of all its motions, with noise.
const READINGS: usize = 4096;
const DT_S: f64 = 0.004;

/// Gyro, accelerometer and magnetometer.
fn swaying() -> Vec<[Vector3<f64>; 3]> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut noise = |sigma: f64| -> Vector3<f64> {
        Vector3::from_fn(|_, _| StandardNormal.sample(&mut rng)) * sigma
    };
    let attitude = |i: usize| {
        let t = TAU * i as f64 / READINGS as f64;
        UnitQuaternion::from_euler_angles(
            (3.0 * t).sin(),
            0.8 * (5.0 * t).cos(),
            2.0 * (2.0 * t).sin(),
        )
    };
    let reading = |i: usize| {
        let to_body = attitude(i).inverse();
        let gyro = (attitude(i + READINGS - 1).inverse() * attitude(i)).scaled_axis() / DT_S;
        let push = Vector3::new((0.1 * i as f64).sin(), 0.0, 0.3);
        [
            gyro + Vector3::new(0.01, -0.005, 0.003) + noise(2e-3),
            to_body * (Vector3::z() * 9.81 + push) + noise(0.03),
            to_body * Vector3::new(0.0, 20.0, -43.0) + noise(0.4),
        ]
    };
    (0..READINGS).map(reading).collect()
}

fn attitude(c: &mut Criterion) {
    let readings = swaying();
    for method in [Method::Inertial, Method::Invariant] {
        let config = AttitudeConfig {
            method,
            ..AttitudeConfig::default()
        };
        let mut filter = AttitudeFilter::new(config).expect("valid settings");
        let mut i = 0;
        c.bench_function(&format!("attitude step, {method:?}"), |bench| {
            bench.iter(|| {
                i = (i + 1) % READINGS;
                let [gyro, accel, mag] = &readings[i];
                filter.step(
                    black_box(gyro),
                    black_box(accel),
                    Some(black_box(mag)),
                    DT_S,
                )
            });
        });
    }
}

fn navigation(c: &mut Criterion) {
    let mut filter = NavigationFilter::new(NavigationConfig::default()).expect("valid settings");
    let mut sample = ImuSample {
        stamp: Stamp::from_ns(0),
        gyro_rad_s: Vector3::new(0.1, 0.2, -0.1),
        accel_m_s2: Vector3::new(0.1, -9.8, 0.2),
    };
    let mut count = 0_u32;
    c.bench_function("navigation inertial reading", |bench| {
        bench.iter(|| {
            sample.stamp = sample.stamp.plus_seconds(0.005);
            count += 1;
            if count.is_multiple_of(100) {
                // keeps the numbers of an endless run small
                filter.push_velocity(sample.stamp, &Vector3::zeros(), &Matrix3::identity());
            }
            filter.push_imu(black_box(&sample))
        });
    });
    let mut filter = ImuBiasEstimator::new(ImuBiasConfig::default()).expect("valid settings");
    let (gyro, accel) = (sample.gyro_rad_s, sample.accel_m_s2);
    c.bench_function("imu bias filter step", |bench| {
        bench.iter(|| filter.step(black_box(&gyro), &accel, None, None, 0.005));
    });
}

/// Frames of a hand-held camera at 42 Hz, with the velocities that lead to them.
fn frames(camera: &Camera, count: usize) -> Vec<(Plane<f32>, RangeMap, ImageVelocity)> {
    let motion = Motion::hand_held(3);
    let renderer = Renderer::new(&Scene::thesis_room(), camera);
    let frame = |i: usize| {
        let (before, now) = ((i as f64 - 1.0) / 42.0, i as f64 / 42.0);
        let (from, to) = (motion.pose(before), motion.pose(now));
        let twist = twist_between(&from, &to, 1.0 / 42.0).expect("a small turn");
        let image = renderer.render(&to);
        let velocity = ImageVelocity {
            angular_rad_s: twist.angular_rad_s + Vector3::new(0.05, 0.0, 0.0),
            linear_m_s: Some(twist.linear_m_s + Vector3::new(2.5, 0.0, 0.0)),
        };
        (image.grey, image.range, velocity)
    };
    (0..count).map(frame).collect()
}

/// Thesis: section 5.4.3: a camera that moves, biases of 2.5 m/s and 0.05 rad/s. Each pass over the
/// ten seconds begins with a new estimator, so that the way in is timed too.
fn velocity_bias(c: &mut Criterion) {
    let camera = Camera::pinhole(171.6, 164.8, 79.5, 59.5, 160, 120).expect("a valid camera");
    let frames = LazyCell::new(|| frames(&camera, 420));
    let new = || {
        VelocityBiasEstimator::new(&camera, VelocityBiasConfig::default()).expect("valid settings")
    };
    let (mut estimator, mut i) = (new(), 0);
    c.bench_function(
        "velocity bias, information form, 160x120, moving",
        |bench| {
            bench.iter(|| {
                if i == frames.len() {
                    (estimator, i) = (new(), 0);
                }
                let (grey, range, velocity) = &frames[i];
                i += 1;
                estimator.step(black_box(grey), range, velocity, 1.0 / 42.0)
            });
        },
    );
}

criterion_group!(benches, attitude, navigation, velocity_bias);
criterion_main!(benches);
