//! Variational depth, an observer and the depth filter at 640x480; one thread with
//! `RAYON_NUM_THREADS=1`.

mod room_frames;

use criterion::{Criterion, criterion_group, criterion_main};
use room_frames::{Fallible, Frames, RATE_HZ, group};
use sphereflow_core::{Plane, Pose, Stamp};
use sphereflow_depth::{
    DataTerm, DepthFilter, DepthFilterConfig, FlowObserver, ObserverConfig, PixelRays,
    SobolevConfig, SobolevDepth, TvDepth, TvDepthConfig,
};
use sphereflow_flow::FlowField;
use std::hint::black_box;

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
    for part in [known_motion, filter] {
        if let Err(error) = part(criterion) {
            panic!("{error}");
        }
    }
}

criterion_group!(depth_benches, benches);
criterion_main!(depth_benches);
