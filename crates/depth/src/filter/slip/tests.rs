//! What is measured where a step lacks a movement, and where it lacks none.

use super::*;
use crate::filter::lattice::Lattice;
use crate::filter::prepare::{Preparation, Prepared};
use crate::filter::state::Drift;
use crate::filter::step::Step;
use nalgebra::Rotation3;
use sphereflow_core::Plane;
use sphereflow_sphere::Camera;

const WIDTH: usize = 160;
const HEIGHT: usize = 120;
const FOCAL_PX: f64 = 150.0;
/// The painted wall stands this far before the past camera, metres.
const WALL_M: f64 = 2.0;

/// Smoothing at borders and reading between pixels leave a hundredth of a pixel or two, and so does the single
/// linearisation over half a pixel, on the eight rows of so small an image that are asked.
const OFF_PX: f64 = 0.03;

/// The movement that is to be found, pixels in the middle of the image.
const MISSING_PX: f64 = 0.5;

/// Before a wall movements and turns look alike: a fifth of what is missing may be taken for the other.
const ALIKE_PX: f64 = 0.1;

/// What is clear to the filter in 640x480 (60), of a quarter of its pixels.
const CLEAR: f64 = 15.0;

/// What is known of poses before, rad and metres.
const TOLD: Drift = Drift {
    rotation: 1e-4,
    translation: 4e-4,
};

fn camera() -> Camera {
    Camera::pinhole(FOCAL_PX, FOCAL_PX, 79.5, 59.5, WIDTH, HEIGHT).unwrap()
}

fn paint(x: f64, y: f64) -> f32 {
    let waves = (9.0 * x + 3.0 * y).sin() + (7.0 * y - 2.0 * x).sin() + (5.0 * (x + y)).sin();
    (128.0 + 35.0 * waves) as f32
}

/// What a camera sees of the wall, and its inverse depth there; `X_past = rotation X + place`.
fn view(
    lattice: &Lattice,
    rotation: &Rotation3<f64>,
    place: &Vector3<f64>,
) -> (Plane<f32>, Vec<Node>) {
    let mut nodes = Vec::with_capacity(lattice.ray.len());
    let image = Plane::from_fn(WIDTH, HEIGHT, |x, y| {
        let along = rotation * lattice.ray[y * WIDTH + x].cast::<f64>();
        let depth = (WALL_M - place.z) / along.z;
        let point = along * depth + place;
        nodes.push([(1.0 / depth) as f32, 0.0, 1e6, 1e-8]);
        paint(point.x, point.y)
    });
    (image, nodes)
}

/// What is measured where the step lacks a movement of the past camera, and ranges are off by a factor.
fn measure(turned: &Rotation3<f64>, moved: &Vector3<f64>, factor: f32, told: Drift) -> Slip {
    let lattice = Lattice::new(&camera()).unwrap();
    let rotation = Rotation3::new(Vector3::new(0.02, -0.03, 0.5));
    let place = Vector3::new(0.06, -0.04, 0.03);
    let (past, _) = view(&lattice, &Rotation3::identity(), &Vector3::zeros());
    let (new, mut nodes) = view(&lattice, &rotation, &place);
    nodes.iter_mut().for_each(|node| node[0] /= factor);
    let mut preparation = Preparation::new(WIDTH, HEIGHT, 1);
    // The images have no noise.
    let mut prepare = |image| preparation.prepare(image, &lattice, Some(0.0), Prepared::empty());
    let (past, new) = (prepare(&past), prepare(&new));
    let pair = Pair {
        lattice: &lattice,
        step: Step {
            rotation: (turned.inverse() * rotation).matrix().cast(),
            translation: (turned.inverse() * (place - moved)).cast(),
        },
        new: &new,
        past: &past,
        surface: &[],
        gain: vec![1.0; HEIGHT],
        told: vec![1.0; HEIGHT],
        drift: told,
        lag: 1,
        repeats: 1.0,
    };
    let known = Known::of(&pair, 1.0 / WALL_M);
    lattice.lens.with(MeasureSlip {
        pair: &pair,
        nodes: &nodes,
        known,
    })
}

fn axes() -> [Vector3<f64>; 4] {
    let slanted = Vector3::new(0.6, -0.48, 0.64);
    [Vector3::x(), Vector3::y(), Vector3::z(), slanted]
}

#[test]
fn slip_of_exact_data_is_none() {
    for told in [Drift::default(), TOLD] {
        let slip = measure(&Rotation3::identity(), &Vector3::zeros(), 1.0, told);
        assert!(slip.rotation().norm() * FOCAL_PX < OFF_PX, "{slip:?}");
        assert!(slip.place().norm() / WALL_M * FOCAL_PX < OFF_PX, "{slip:?}");
    }
}

#[test]
fn slip_of_a_missing_movement_is_told_apart_from_ranges_that_are_off_by_a_tenth() {
    let missing = Vector3::new(0.6, 0.8, 0.0) * MISSING_PX / FOCAL_PX * WALL_M;
    for factor in [1.0, 1.1] {
        let slip = measure(&Rotation3::identity(), &missing, factor, TOLD);
        let place = slip.place();
        // Along the step it is the ranges that move as well.
        let along = Vector3::new(0.06, -0.04, 0.0).normalize();
        let across = along.cross(&Vector3::z());
        let off_px = (place - missing).dot(&across) / WALL_M * FOCAL_PX;
        let turned_px = slip.rotation().norm() * FOCAL_PX;
        assert!(off_px.abs() < ALIKE_PX, "{factor}: {slip:?}, {off_px}");
        assert!(turned_px < ALIKE_PX, "{factor}: {slip:?}, {turned_px}");
    }
}

#[test]
fn slip_of_a_missing_rotation_is_that_rotation_in_the_past_camera() {
    let size = MISSING_PX / FOCAL_PX;
    for axis in axes() {
        for sign in [1.0, -1.0] {
            let missing = axis * sign * size;
            let none = Vector3::zeros();
            let slip = measure(&Rotation3::new(missing), &none, 1.0, Drift::default());
            let off_px = (slip.rotation() - missing).norm() * FOCAL_PX;
            assert!(off_px < OFF_PX, "{missing:?}: {slip:?}, {off_px}");
            assert!(slip.chi > CLEAR, "{missing:?}: {slip:?}");
        }
    }
}
