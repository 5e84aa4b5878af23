//! A pair of images asks for no memory once the first has been measured.
#![allow(unsafe_code, clippy::unwrap_used)] // a test may; counting needs an allocator of its own

mod scene;

use scene::{DT_S, Scene, pinhole, somewhere, twist};
use sphereflow_alignment::{
    Aligner, BrightnessPyramid, Config, DepthImage, FramePyramid, Method, Priors,
    VelocityEstimator, pose_from_twist,
};
use sphereflow_core::{Plane, Pose};
use sphereflow_sphere::RollingShutter;
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

/// One test: allocations of another one that runs at the same time would be counted too.
///
/// Runs in a pool of one thread: another one would hand jobs around in blocks of its own.
#[test]
fn alignment_after_the_first_allocates_nothing() {
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
    let aligner = Aligner::new(&camera, Config::default()).unwrap();
    let count = pool.install(|| align_again(aligner, &[first, second]));
    assert_eq!(count, 0, "aligner");
}

/// Allocations of aligning, with brightness, a frame that was averaged anew, undoing its rolling
/// shutter, and looking at the overlap: the second time.
fn align_again(mut aligner: Aligner, depths: &[sphereflow_core::DepthMap; 2]) -> usize {
    let (width, height) = (aligner.camera().width(), aligner.camera().height());
    let image = Plane::from_fn(width, height, |x, y| ((x * 7 + y * 3) % 200) as f32);
    let mut frames = [(); 2].map(|()| FramePyramid::default());
    let mut brightness = BrightnessPyramid::default();
    let mut undone = FramePyramid::default();
    let shutter = RollingShutter {
        twist: twist([0.1, 0.0, 0.0, 0.2, 0.0, 0.0]),
        readout_s: 0.02,
    };
    let mut before = 0;
    for _ in 0..2 {
        before = COUNT.load(Ordering::Relaxed);
        for (depth, frame) in depths.iter().zip(&mut frames) {
            let depth = DepthImage::from(depth);
            aligner.average(&depth, "depth", frame).unwrap();
        }
        let name = "image";
        aligner
            .average_brightness(&image, name, &mut brightness)
            .unwrap();
        let priors = Priors {
            brightness: Some((&brightness, &brightness)),
            restart: true,
            ..Priors::default()
        };
        let found = aligner.align(&frames[0], &frames[1], Pose::identity(), &priors);
        assert!(found.solves > 0);
        aligner.undo_rolling_shutter(&frames[1], shutter, &mut undone);
        aligner.overlap_and_flow(&undone, &found.motion);
    }
    COUNT.load(Ordering::Relaxed) - before
}
