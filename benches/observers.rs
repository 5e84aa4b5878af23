//! A step of the attitude filter, an inertial reading of the navigation filter, a pair of images of
//! the information form.

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{Matrix3, Vector3};
use sphereflow_core::{ImuSample, Plane, RangeMap, Stamp};
use sphereflow_observers::attitude::{AttitudeConfig, AttitudeFilter, Method};
use sphereflow_observers::imu_bias::{ImuBiasConfig, ImuBiasEstimator};
use sphereflow_observers::navigation::{NavigationConfig, NavigationFilter};
use sphereflow_observers::velocity_bias::{
    ImageVelocity, VelocityBiasConfig, VelocityBiasEstimator,
};
use sphereflow_sphere::Camera;
use std::hint::black_box;

fn attitude(c: &mut Criterion) {
    for method in [Method::Inertial, Method::Invariant] {
        let config = AttitudeConfig {
            method,
            ..AttitudeConfig::default()
        };
        let mut filter = AttitudeFilter::new(config).expect("valid settings");
        let (mut gyro, accel) = (Vector3::new(0.3, -0.2, 0.5), Vector3::new(0.5, 0.3, 9.7));
        let mag = Vector3::new(3.0, 20.0, -40.0);
        c.bench_function(&format!("attitude step, {method:?}"), |bench| {
            bench.iter(|| {
                gyro.x = -gyro.x;
                filter.step(black_box(&gyro), &accel, Some(&mag), 0.0035)
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

fn velocity_bias(c: &mut Criterion) {
    let camera = Camera::pinhole(170.0, 165.0, 79.5, 59.5, 160, 120).expect("a valid camera");
    let wave = |x: usize, y: usize| (0.3 * x as f32).sin() + (0.2 * y as f32).cos();
    let grey = Plane::from_fn(160, 120, |x, y| 128.0 + 50.0 * wave(x, y));
    let range = RangeMap::new(Plane::from_fn(160, 120, |x, y| {
        3.0 + 0.01 * x as f32 - 0.005 * y as f32
    }));
    let velocity = ImageVelocity {
        angular_rad_s: Vector3::zeros(),
        linear_m_s: Some(Vector3::zeros()),
    };
    let config = VelocityBiasConfig::default();
    let mut estimator = VelocityBiasEstimator::new(&camera, config).expect("valid settings");
    c.bench_function("velocity bias, information form, 160x120", |bench| {
        bench.iter(|| estimator.step(black_box(&grey), &range, &velocity, 0.03));
    });
}

criterion_group!(benches, attitude, navigation, velocity_bias);
criterion_main!(benches);
