//! No iteration asks for memory: what a solve allocates does not depend on how many it makes.
#![allow(unsafe_code, clippy::unwrap_used)]

use sphereflow_solver::bundle::BundleAdjuster;
use sphereflow_solver::generate::{
    GraphKind, GraphSettings, SceneKind, SceneSettings, graph, scene,
};
use sphereflow_solver::graph::LoopSwitch;
use sphereflow_solver::{LinearSolver, Options};
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
fn bundle(settings: &SceneSettings, solver: LinearSolver) -> [usize; 2] {
    let problem = scene(settings).unwrap().problem;
    let poses: Vec<_> = (0..problem.poses())
        .filter_map(|k| problem.pose(k))
        .collect();
    let points: Vec<_> = (0..problem.points())
        .filter_map(|k| problem.point(k))
        .collect();
    let mut adjuster = BundleAdjuster::new(problem, solver);
    let mut run = |count| {
        adjuster.restart(&poses, &points).unwrap();
        counted(|| {
            let summary = adjuster.solve(&steps(count)).unwrap();
            assert_eq!(summary.iterations.len(), count);
        })
    };
    run(2);
    [run(2), run(6)]
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
            let [two, six] = bundle(settings, solver);
            println!("{name}: {two} allocations of 2 steps, {six} of 6");
            assert_eq!(two, six, "{name}");
        }
        let run = |count| {
            let settings = GraphSettings::new(GraphKind::Torus, 12, 12, 1);
            let mut made = graph(&settings).unwrap().graph;
            counted(|| {
                let summary = made.solve(LoopSwitch::Off, &steps(count)).unwrap();
                assert_eq!(summary.summary.iterations.len(), count);
            })
        };
        run(2);
        let [two, six] = [run(2), run(6)];
        println!("pose graph: {two} allocations of 2 steps, {six} of 6 (all set-up)");
        assert_eq!(two, six);
    });
}
