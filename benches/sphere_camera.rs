//! Camera models: rays of all pixels of a 640 x 480 image, and pixels of those rays.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{Vector2, Vector3};
use sphereflow_sphere::Camera;
use std::hint::black_box;

const WIDTH: usize = 640;
const HEIGHT: usize = 480;

/// One calibration of every model that sees the whole image or nearly so.
fn cameras() -> sphereflow_core::Result<Vec<Camera>> {
    let (fx, fy, cx, cy) = (525.0, 520.0, 319.5, 239.5);
    let radial = [0.041, -0.3286, 0.0, 0.0, 0.5643, 0.0, 0.0, 0.0];
    let rational = [0.45, 0.21, 3e-5, -4e-5, 0.011, 0.79, 0.33, 0.058];
    let polynomial = [0.25, 0.1, 0.01, 0.002];
    let angles = [0.0034, 0.0007, -0.0020, 0.0002];
    Ok(vec![
        Camera::pinhole_with_skew(fx, fy, cx, cy, 0.5, WIDTH, HEIGHT)?,
        Camera::opencv(fx, fy, cx, cy, radial, WIDTH, HEIGHT)?,
        Camera::opencv(fx, fy, cx, cy, rational, WIDTH, HEIGHT)?,
        Camera::inverse_polynomial(fx, fy, cx, cy, polynomial, WIDTH, HEIGHT)?,
        Camera::fov(fx, fy, cx, cy, 0.93, WIDTH, HEIGHT)?,
        Camera::kannala_brandt(190.0, 191.0, cx, cy, angles, WIDTH, HEIGHT)?,
        Camera::unified(250.0, 251.0, cx, cy, 0.6, WIDTH, HEIGHT)?,
        Camera::double_sphere(160.0, 161.0, cx, cy, [-0.2, 0.57], WIDTH, HEIGHT)?,
        Camera::equirectangular(WIDTH, HEIGHT)?,
    ])
}

/// Name of the model, with `+` where it is an OpenCV camera with tangential terms.
fn label(camera: &Camera) -> String {
    let tangential = camera
        .named_parameters()
        .iter()
        .any(|(name, value)| name.starts_with('p') && *value != 0.0);
    let mark = if tangential { "+tangential" } else { "" };
    format!("{}{mark}", camera.model_name())
}

fn pixels() -> Vec<Vector2<f64>> {
    (0..WIDTH * HEIGHT)
        .map(|i| Vector2::new((i % WIDTH) as f64, (i / WIDTH) as f64))
        .collect()
}

fn sphere_camera(criterion: &mut Criterion) {
    let Ok(cameras) = cameras() else {
        eprintln!("a camera of the bench was refused");
        return;
    };
    let mut group = criterion.benchmark_group("camera_640x480");
    group.throughput(Throughput::Elements((WIDTH * HEIGHT) as u64));
    group.sample_size(10);
    let pixels = pixels();
    for camera in cameras {
        let rays: Vec<Vector3<f64>> = pixels.iter().filter_map(|p| camera.unproject(p)).collect();
        let label = label(&camera);
        group.bench_function(BenchmarkId::new("unproject", &label), |bencher| {
            bencher.iter(|| {
                let rays = pixels.iter().filter_map(|p| camera.unproject(black_box(p)));
                rays.map(|ray| ray.z).sum::<f64>()
            });
        });
        group.bench_function(BenchmarkId::new("project", &label), |bencher| {
            bencher.iter(|| {
                let seen = rays.iter().filter_map(|r| camera.project(black_box(r)));
                seen.map(|pixel| pixel.x).sum::<f64>()
            });
        });
        group.bench_function(
            BenchmarkId::new("project_with_jacobian", &label),
            |bencher| {
                bencher.iter(|| {
                    let seen = rays
                        .iter()
                        .filter_map(|r| camera.project_with_jacobian(black_box(r)));
                    seen.map(|(_, jacobian)| jacobian[(0, 0)]).sum::<f64>()
                });
            },
        );
    }
    group.finish();
}

criterion_group!(benches, sphere_camera);
criterion_main!(benches);
