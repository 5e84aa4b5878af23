//! No iteration asks for memory: what a solve allocates does not depend on how many it makes.
#![allow(unsafe_code, clippy::unwrap_used)]

use nalgebra::Matrix2;
use sphereflow_sim::problems::{GraphKind, GraphSettings, SceneKind, SceneSettings, graph, scene};
use sphereflow_solver::bundle::{BundleAdjuster, BundleProblem};
use sphereflow_solver::graph::{GraphOptimiser, LoopSwitch};
use sphereflow_solver::{LinearSolver, Loss, Options};
use sphereflow_sphere::Camera;
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

static COUNT: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: everything is handed on to the system's allocator; the counter touches no memory of it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promises are those that the system's allocator asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn steps(count: usize) -> Options {
    Options {
        max_iterations: count,
        function_tolerance: 0.0,
        parameter_tolerance: 0.0,
        gradient_tolerance: 0.0,
        ..Options::default()
    }
}

fn counted(work: impl FnOnce()) -> usize {
    let before = COUNT.load(Ordering::Relaxed);
    work();
    COUNT.load(Ordering::Relaxed) - before
}

/// Allocations of two steps and of six from the same start, after one solve.
fn bundle(
    settings: &SceneSettings,
    solver: LinearSolver,
    change: impl Fn(&mut BundleProblem),
) -> [usize; 2] {
    let mut problem = scene(settings).unwrap().problem;
    change(&mut problem);
    let camera = problem.camera(0).unwrap().clone();
    let poses: Vec<_> = (0..problem.poses())
        .filter_map(|k| problem.pose(k))
        .collect();
    let points: Vec<_> = (0..problem.points())
        .filter_map(|k| problem.point(k))
        .collect();
    let mut adjuster = BundleAdjuster::new(problem, solver);
    let mut run = |count| {
        adjuster.restart(&poses, &points).unwrap();
        adjuster.restart_camera(0, &camera).unwrap();
        counted(|| {
            let summary = adjuster.solve(&steps(count)).unwrap();
            assert_eq!(summary.iterations.len(), count);
        })
    };
    run(2);
    [run(2), run(6)]
}

/// The same scene by a model whose own parameters have derivatives by differences of cameras.
fn through_fisheye(made: &BundleProblem) -> BundleProblem {
    let mut problem = BundleProblem::new();
    // the first terms of the tangent: almost a pinhole
    let series = [1.0 / 3.0, 2.0 / 15.0, 17.0 / 315.0, 62.0 / 2835.0];
    let camera = Camera::kannala_brandt(380.0, 380.0, 319.5, 239.5, series, 640, 480);
    problem.add_camera(camera.unwrap());
    for k in 0..made.poses() {
        problem.add_pose(made.pose(k).unwrap(), 0).unwrap();
    }
    for k in 0..made.points() {
        problem.add_point(made.point(k).unwrap()).unwrap();
    }
    for (pose, point, pixel) in made.pixels() {
        let covariance = Matrix2::identity();
        problem.add_pixel(pose, point, pixel, &covariance).unwrap();
    }
    problem
}

// one test: another one beside it would allocate into the same count
#[test]
fn iterations_do_not_allocate() {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    pool.install(|| {
        let mut few = SceneSettings::new(SceneKind::Room, 80, 40, 5);
        few.track = 40;
        let mut window = SceneSettings::new(SceneKind::Room, 15, 1000, 1);
        window.depth_sigma_m = Some(0.02);
        let street = SceneSettings::new(SceneKind::Street, 80, 2000, 1);
        for (name, settings, solver) in [
            ("window, dense", &window, LinearSolver::Dense),
            ("street, sparse", &street, LinearSolver::Sparse),
            ("street, iterative", &street, LinearSolver::Iterative),
            ("poses eliminated", &few, LinearSolver::Auto),
        ] {
            let free = |problem: &mut BundleProblem| problem.free_intrinsics(0, &["focal", "cx"]);
            for changed in [
                bundle(settings, solver, |_| {}),
                bundle(settings, solver, |problem| free(problem).unwrap()),
                bundle(settings, solver, |problem| {
                    problem.losses.pixel = Loss::Huber(1.0);
                }),
            ] {
                let [two, six] = changed;
                println!("{name}: {two} allocations of 2 steps, {six} of 6");
                assert_eq!(two, six, "{name}");
            }
        }
        let fisheye = |problem: &mut BundleProblem| {
            *problem = through_fisheye(problem);
            problem.free_intrinsics(0, &["focal", "k1", "k2"]).unwrap();
        };
        let [two, six] = bundle(&window, LinearSolver::Auto, fisheye);
        println!("fish-eye, free: {two} allocations of 2 steps, {six} of 6");
        assert_eq!(two, six);
        let settings = GraphSettings::new(GraphKind::Torus, 26, 26, 1);
        let made = graph(&settings).unwrap().graph;
        let start = made.nodes().to_vec();
        let mut optimiser = GraphOptimiser::new(made);
        let mut run = |count| {
            optimiser.restart(&start).unwrap();
            counted(|| {
                let summary = optimiser.solve(LoopSwitch::Off, &steps(count)).unwrap();
                assert_eq!(summary.summary.iterations.len(), count);
            })
        };
        run(2);
        let [two, six] = [run(2), run(6)];
        println!("pose graph: {two} allocations of 2 steps, {six} of 6");
        assert_eq!(two, six);
    });
}
