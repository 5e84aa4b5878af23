//! A pair of images asks for no memory once the first has been measured.
#![allow(unsafe_code, clippy::unwrap_used)] // a test may; counting needs an allocator of its own

mod scene;

use scene::{DT_S, Scene, pinhole, somewhere, twist};
use sphereflow_alignment::{Config, Method, VelocityEstimator, pose_from_twist};
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

/// Runs in a pool of one thread: another one would hand jobs around in blocks of its own.
#[test]
fn estimate_after_the_first_allocates_nothing() {
    let camera = pinhole();
    let motion = twist([0.1, -0.2, 0.15, 0.2, 0.1, -0.3]);
    let room = Scene::room();
    let first = room.depths(&camera, &somewhere());
    let second = room.depths(&camera, &(somewhere() * pose_from_twist(&motion, DT_S)));
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    for method in [Method::Single, Method::Pyramid] {
        let mut estimator = VelocityEstimator::new(&camera, Config::of(method)).unwrap();
        let count = pool.install(|| {
            for _ in 0..2 {
                estimator.estimate(&first, &second, DT_S).unwrap();
            }
            let before = COUNT.load(Ordering::Relaxed);
            let found = estimator.estimate(&first, &second, DT_S).unwrap();
            assert!(found.twist.is_some());
            COUNT.load(Ordering::Relaxed) - before
        });
        assert_eq!(count, 0, "{method:?}");
    }
}
