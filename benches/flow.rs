//! Optical flow at 640x480; one thread with `RAYON_NUM_THREADS=1`.

mod room_frames;

use criterion::{Criterion, criterion_group, criterion_main};
use room_frames::{Fallible, Frames, group};
use sphereflow_flow::{HornSchunckConfig, TvL1Config, TvL1Flow, horn_schunck, tv_l1};
use std::hint::black_box;

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

fn benches(criterion: &mut Criterion) {
    if let Err(error) = flow(criterion) {
        panic!("{error}");
    }
}

criterion_group!(flow_benches, benches);
criterion_main!(flow_benches);
