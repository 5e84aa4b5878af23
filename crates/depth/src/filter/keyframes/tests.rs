//! Keyframes of the depth filter: what is remembered, and when it comes back.

#![allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to

use super::*;
use crate::filter::state::fresh;
use nalgebra::{UnitQuaternion, Vector3};
use sphereflow_sphere::Camera;

const WIDTH: usize = 160;
const HEIGHT: usize = 120;

/// Relative deviation of ranges in the keyframe.
const DEVIATION: f32 = 0.01;

/// Single precision, and zeta read between pixels, which is exact on planes.
const ROUNDING: f32 = 1e-4;

/// Share of information that survives a frame.
const MEMORY: f32 = 0.9;

/// Pixels at the left border that have come into view.
const STRIP: usize = 12;

fn lattice() -> Lattice {
    Lattice::new(&Camera::pinhole(150.0, 150.0, 79.5, 59.5, WIDTH, HEIGHT).unwrap()).unwrap()
}

fn present(world_from_camera: Pose) -> Present {
    Present {
        world_from_camera,
        drift: Drift::default(),
        noise: Drift::default(),
    }
}

/// The second place: turned to the right, and moved.
fn turned() -> Pose {
    Pose {
        rotation: UnitQuaternion::from_euler_angles(0.02, 0.1, -0.03),
        translation: Vector3::new(0.1, -0.05, 0.08),
    }
}

/// Zeta of a slanted wall from a place; before it, in the middle, there may be a board.
fn zeta(lattice: &Lattice, at: usize, pose: &Pose, board: bool) -> f32 {
    let ray = pose.rotation * lattice.ray[at].cast::<f64>();
    let depth_to = |normal: Vector3<f64>| (1.0 - normal.dot(&pose.translation)) / normal.dot(&ray);
    let wall = depth_to(Vector3::new(0.05, -0.1, 0.4));
    let before = depth_to(Vector3::new(0.0, 0.0, 1.0));
    let point = pose.translation + ray * before;
    let hides = board && point.x.abs() < 0.15 && point.y.abs() < 0.2;
    (1.0 / if hides { before } else { wall }) as f32
}

fn state(lattice: &Lattice, pose: &Pose, board: bool) -> Vec<Node> {
    (0..WIDTH * HEIGHT)
        .map(|at| {
            let zeta = zeta(lattice, at, pose, board);
            let variance = (DEVIATION * zeta).powi(2);
            [zeta, 0.0, 1.0 / variance, variance]
        })
        .collect()
}

/// Nodes of which those in `new` have just come into view, with a wrong zeta; and what moved where.
fn seen(lattice: &Lattice, pose: &Pose, new: impl Fn(usize) -> bool) -> (Vec<Node>, Vec<f32>) {
    let mut nodes = state(lattice, pose, true);
    let mut nearest: Vec<f32> = nodes.iter().map(|node| node[0]).collect();
    for at in (0..nodes.len()).filter(|at| new(*at)) {
        nodes[at] = fresh(1.3 * nodes[at][0], true);
        nearest[at] = 0.0;
    }
    (nodes, nearest)
}

fn remembering(lattice: &Lattice, at: &Present) -> Keyframes {
    let mut keyframes = Keyframes::new(4);
    let nodes = state(lattice, &at.world_from_camera, true);
    keyframes.keep(lattice, &nodes, at);
    keyframes
}

fn in_strip(at: usize) -> bool {
    at % WIDTH < STRIP
}

#[test]
fn what_comes_into_view_is_what_a_keyframe_saw_there() {
    let lattice = lattice();
    let mut keyframes = remembering(&lattice, &present(Pose::identity()));
    let pose = turned();
    let (mut nodes, nearest) = seen(&lattice, &pose, in_strip);
    let before = nodes.clone();
    keyframes.recall(&lattice, (&mut nodes, &nearest), &present(pose), MEMORY);
    let mut recalled = 0;
    for (at, (node, before)) in nodes.iter().zip(&before).enumerate() {
        if !in_strip(at) {
            assert_eq!(node, before);
            continue;
        }
        if node == before {
            continue;
        }
        recalled += 1;
        let expected = zeta(&lattice, at, &pose, true);
        assert!(
            (node[0] / expected - 1.0).abs() < ROUNDING,
            "{}, {expected}",
            node[0]
        );
        // One frame old; a wall's nearness changes little from place to place.
        let variance = (DEVIATION * expected).powi(2) / MEMORY;
        assert!(
            (node[3] / variance - 1.0).abs() < 0.3,
            "{}, {variance}",
            node[3]
        );
        assert!(node[2] < 1.0 / node[3]);
    }
    assert!(recalled > 9 * STRIP * HEIGHT / 10, "{recalled}");
}

#[test]
fn what_was_hidden_in_the_keyframe_is_not_recalled() {
    let lattice = lattice();
    let mut keyframes = remembering(&lattice, &present(Pose::identity()));
    // From the side, the wall behind the board.
    let pose = Pose {
        rotation: UnitQuaternion::identity(),
        translation: Vector3::new(0.15, 0.0, 0.0),
    };
    let shown = |at: usize| {
        let ray = lattice.ray[at].cast::<f64>();
        let depth = f64::from(1.0 / zeta(&lattice, at, &pose, true));
        let point = pose.translation + ray * depth;
        // Well inside the board as seen from the keyframe, and not on the board.
        let [x, y] = [point.x / point.z, point.y / point.z];
        depth > 1.5 && x.abs() < 0.13 && y.abs() < 0.18
    };
    let (mut nodes, nearest) = seen(&lattice, &pose, shown);
    let before = nodes.clone();
    let count = (0..nodes.len()).filter(|at| shown(*at)).count();
    assert!(count > 100, "{count}");
    keyframes.recall(&lattice, (&mut nodes, &nearest), &present(pose), MEMORY);
    assert!(nodes == before);
}

#[test]
fn doubts_of_the_pose_are_added_and_too_large_ones_forbid_to_recall() {
    let lattice = lattice();
    let pose = turned();
    let node_with = |drift: Drift| {
        let mut keyframes = remembering(&lattice, &present(Pose::identity()));
        let (mut nodes, nearest) = seen(&lattice, &pose, in_strip);
        let now = Present {
            drift,
            ..present(pose)
        };
        keyframes.recall(&lattice, (&mut nodes, &nearest), &now, MEMORY);
        nodes[60 * WIDTH + 6]
    };
    let exact = node_with(Drift::default());
    let translation = 1e-6;
    let moved = node_with(Drift {
        rotation: 0.0,
        translation,
    });
    let more = exact[0].powi(4) * translation;
    assert!(((moved[3] - exact[3]) / more - 1.0).abs() < 1e-2);
    // Twenty pixels.
    let lost = node_with(Drift {
        rotation: 0.02,
        translation: 0.0,
    });
    assert_eq!(
        lost,
        fresh(1.3 * zeta(&lattice, 60 * WIDTH + 6, &pose, true), true)
    );
}

#[test]
fn places_that_differ_are_kept_up_to_the_number_that_is_asked() {
    let lattice = lattice();
    let mut keyframes = Keyframes::new(4);
    let at = |turn: f64| {
        present(Pose {
            rotation: UnitQuaternion::from_euler_angles(0.0, turn, 0.0),
            translation: Vector3::zeros(),
        })
    };
    for frame in 0..10 {
        keyframes.frame = frame;
        let here = at(1e-3 * frame as f64);
        let nodes = state(&lattice, &here.world_from_camera, true);
        keyframes.keep(&lattice, &nodes, &here);
    }
    assert_eq!(keyframes.kept.len(), 1);
    for frame in 10..20 {
        keyframes.frame = frame;
        let here = at(0.2 * (frame - 9) as f64);
        let nodes = state(&lattice, &Pose::identity(), true);
        keyframes.keep(&lattice, &nodes, &here);
    }
    let mut frames: Vec<usize> = keyframes.kept.iter().map(|kept| kept.frame).collect();
    frames.sort_unstable();
    assert_eq!(frames, [16, 17, 18, 19]);
    let mut none = Keyframes::new(0);
    none.keep(
        &lattice,
        &state(&lattice, &Pose::identity(), true),
        &at(0.0),
    );
    assert!(none.kept.is_empty());
}
