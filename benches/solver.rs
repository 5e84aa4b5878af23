//! Bundle adjustment of a local window: 15 poses, 3000 points, pixels and depths, on one core.

use criterion::{Criterion, criterion_group, criterion_main};
use sphereflow_sim::problems::{SceneKind, SceneSettings, scene};
use sphereflow_solver::bundle::BundleAdjuster;
use sphereflow_solver::{LinearSolver, Options};

/// Five iterations from the same start, after one set-up.
fn local_window(c: &mut Criterion) {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    for (name, depth) in [("pixels_and_depths", Some(0.02)), ("pixels", None)] {
        let mut settings = SceneSettings::new(SceneKind::Room, 15, 3000, 1);
        settings.depth_sigma_m = depth;
        let problem = scene(&settings).unwrap().problem;
        let poses: Vec<_> = (0..problem.poses())
            .filter_map(|k| problem.pose(k))
            .collect();
        let points: Vec<_> = (0..problem.points())
            .filter_map(|k| problem.point(k))
            .collect();
        println!("{} measurements", problem.observations());
        let options = Options {
            max_iterations: 5,
            function_tolerance: 0.0,
            parameter_tolerance: 0.0,
            ..Options::default()
        };
        let mut adjuster = BundleAdjuster::new(problem, LinearSolver::Auto);
        c.bench_function(&format!("solver/window_15x3000/{name}"), |b| {
            b.iter(|| {
                adjuster.restart(&poses, &points).unwrap();
                let summary = pool.install(|| adjuster.solve(&options).unwrap());
                assert_eq!(summary.iterations.len(), 5);
            })
        });
    }
}

criterion_group!(benches, local_window);
criterion_main!(benches);
