//! Decoding of depth images: unpacking of 11 bits and registration to colour, on one core.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use sphereflow_core::Plane;
use sphereflow_sensors::bits::{pack, unpack};
use sphereflow_sensors::disparity::DisparityModel;
use sphereflow_sensors::registration::{COEFFICIENTS, Registration, RegistrationParameters};
use std::hint::black_box;

/// A wall with steps, one pixel of 17 without a reading.
fn disparities() -> Vec<u16> {
    let pixel = |i: usize| match i % 17 {
        0 => 2047,
        _ => 600 + (i / 640 / 60 * 40 + i % 640 / 80 * 10) as u16,
    };
    (0..640 * 480).map(pixel).collect()
}

fn depth_image(criterion: &mut Criterion) {
    let packed = pack(11, &disparities());
    let model = DisparityModel::TYPICAL;
    let mut values = [0; COEFFICIENTS];
    (values[5], values[17], values[20]) = (-3000, 200, 150);
    let parameters = RegistrationParameters::from_values(&values);
    let registration = Registration::new(640, 480, &parameters, &model, 0).unwrap();
    let mut group = criterion.benchmark_group("sensors");
    group.throughput(Throughput::Elements(1)); // frames
    group.bench_function("unpack_11", |bencher| {
        let mut pixels = vec![0; 640 * 480];
        bencher.iter(|| unpack(11, black_box(&packed), &mut pixels));
    });
    group.bench_function("unpack_11_and_register", |bencher| {
        bencher.iter(|| {
            let mut pixels = vec![0; 640 * 480];
            unpack(11, black_box(&packed), &mut pixels);
            registration.apply(&Plane::from_vec(640, 480, pixels).unwrap())
        });
    });
    group.finish();
}

criterion_group!(benches, depth_image);
criterion_main!(benches);
