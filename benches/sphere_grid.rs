//! Operators of the sphere grid, pyramids and warps at 640x480.

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{UnitQuaternion, Vector3};
use sphereflow_core::{DepthMap, Plane, Pose, RangeMap, Result};
use sphereflow_sphere::{Border, Camera, SphereGrid, Warp, range_from_depth};
use std::hint::black_box;
use std::time::Duration;

fn pinhole() -> Result<Camera> {
    Camera::pinhole(525.0, 525.0, 319.5, 239.5, 640, 480)
}

/// A slanted wall 2 to 3 m away with some bumps.
fn depth() -> DepthMap {
    DepthMap::new(Plane::from_fn(640, 480, |x, y| {
        let bump = 0.05 * (0.02 * (x as f32)).sin() * (0.03 * (y as f32)).cos();
        1.0 / (0.4 + 0.0001 * x as f32 - 0.00005 * y as f32) + bump
    }))
}

fn operators(criterion: &mut Criterion) -> Result<()> {
    let camera = pinhole()?;
    let grid = SphereGrid::new(&camera)?;
    let scalar: Vec<f64> = grid.rays().iter().map(|ray| (3.0 * ray.x).sin()).collect();
    let mut gradient = vec![Vector3::zeros(); scalar.len()];
    let mut out = vec![0.0; scalar.len()];
    grid.gradient_into(&scalar, &mut gradient)?;
    let vector = gradient.clone();
    let mut group = criterion.benchmark_group("grid 640x480");
    group
        .sample_size(10)
        .measurement_time(Duration::from_secs(1));
    group.warm_up_time(Duration::from_millis(300));
    group.bench_function("new", |b| b.iter(|| SphereGrid::new(black_box(&camera))));
    group.bench_function("gradient", |b| {
        b.iter(|| grid.gradient_into(black_box(&scalar), &mut gradient))
    });
    group.bench_function("divergence", |b| {
        b.iter(|| {
            let field = black_box(&vector);
            grid.divergence_into(field, Border::Extrapolate, &mut out)
        })
    });
    group.bench_function("laplacian", |b| {
        b.iter(|| {
            let field = black_box(&scalar);
            grid.laplacian_into(field, Border::Extrapolate, &mut out)
        })
    });
    group.finish();
    Ok(())
}

fn warps(criterion: &mut Criterion) -> Result<()> {
    let camera = pinhole()?;
    let depth = depth();
    let range: RangeMap = range_from_depth(&depth, &camera)?;
    let image = Plane::from_fn(640, 480, |x, y| (x + y) as f32);
    let rotation = UnitQuaternion::from_euler_angles(0.01, -0.02, 0.015);
    let pose = Pose::new(rotation, Vector3::new(0.03, -0.01, 0.02));
    let warp = Warp::new(&camera, &camera, pose);
    let mut group = criterion.benchmark_group("warp 640x480");
    group
        .sample_size(10)
        .measurement_time(Duration::from_secs(1));
    group.warm_up_time(Duration::from_millis(300));
    group.bench_function("render_range", |b| {
        b.iter(|| warp.render_range(black_box(&range), 0.12))
    });
    group.bench_function("look_up", |b| {
        b.iter(|| warp.look_up(black_box(&image), &range))
    });
    group.bench_function("visible", |b| {
        b.iter(|| warp.visible(black_box(&range), &range, 0.05))
    });
    group.finish();
    Ok(())
}

fn sphere_grid(criterion: &mut Criterion) {
    if let Err(error) = operators(criterion).and_then(|()| warps(criterion)) {
        eprintln!("the bench could not be set up: {error}");
    }
}

criterion_group!(benches, sphere_grid);
criterion_main!(benches);
