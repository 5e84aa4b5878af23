//! Table 6.1: the time that the thesis's method takes, by the number of domains, at 640x480.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use nalgebra::{Vector2, Vector3};
use sphereflow_alignment::pose_from_twist;
use sphereflow_baselines::{ThesisConfig, ThesisEstimator, TimeRule};
use sphereflow_core::{DepthMap, Plane, Twist};
use sphereflow_sphere::Camera;
use std::hint::black_box;
use std::time::{Duration, Instant};

const DT_S: f64 = 1.0 / 30.0;

/// Thesis: Table 6.1: domains and milliseconds, on an Intel Core i5-2520M at 2.5 GHz.
const PRINTED: [(usize, f64); 5] = [
    (40, 6.5),
    (100, 8.8),
    (200, 15.3),
    (500, 38.0),
    (1000, 76.6),
];

/// Exact depth of a corner of three slanted walls after `time_s` seconds of motion.
fn view(camera: &Camera, time_s: f64) -> DepthMap {
    let walls = [
        ([0.5, 0.1, 1.0], 3.0),
        ([-0.7, 0.2, 1.0], 2.8),
        ([0.1, 0.9, 0.6], 2.0),
    ]
    .map(|(n, d)| (Vector3::from(n).normalize(), d));
    let motion = Twist::from_vector(&[0.3, -0.4, 0.2, 0.25, -0.1, 0.3].into());
    let pose = pose_from_twist(&motion, time_s);
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

/// Median time of one estimate over half a second, on one thread.
fn median(estimator: &mut ThesisEstimator, a: &DepthMap, b: &DepthMap) -> Duration {
    let start = Instant::now();
    let mut times = Vec::new();
    while start.elapsed() < Duration::from_millis(500) {
        let one = Instant::now();
        black_box(estimator.estimate(black_box(a), black_box(b), DT_S)).expect("right sizes");
        times.push(one.elapsed());
    }
    times.sort();
    times[times.len() / 2]
}

fn table_6_1(c: &mut Criterion) {
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build_global()
        .expect("the first to ask for threads");
    let camera = Camera::pinhole(525.0, 525.0, 319.5, 239.5, 640, 480).expect("a camera");
    let (a, b) = (view(&camera, 0.0), view(&camera, DT_S));
    let mut rows = Vec::new();
    let mut group = c.benchmark_group("Table 6.1");
    for (domains, printed) in PRINTED {
        let mut cells = Vec::new();
        for time in [TimeRule::Forward, TimeRule::Trapezoid] {
            let config = ThesisConfig {
                domains,
                time,
                ..ThesisConfig::default()
            };
            let mut estimator = ThesisEstimator::new(&camera, config).expect("settings");
            cells.push(1e3 * median(&mut estimator, &a, &b).as_secs_f64());
            let id = BenchmarkId::new(format!("{time:?}"), domains);
            group.bench_function(id, |bench| {
                bench.iter(|| estimator.estimate(black_box(&a), black_box(&b), DT_S))
            });
        }
        let ours = format!("{:.2} | {:.2}", cells[0], cells[1]);
        rows.push(format!("| {domains} | {printed} | {ours} |"));
    }
    group.finish();
    println!("| domains | Table 6.1 (2011) ms | forward ms | trapezoid ms |");
    println!("| --- | --- | --- | --- |\n{}", rows.join("\n"));
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(30).measurement_time(Duration::from_secs(2)).warm_up_time(Duration::from_millis(300));
    targets = table_6_1
}
criterion_main!(benches);
