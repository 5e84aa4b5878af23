//! Brightness as a second conserved field: planes and corridors become observable.
//!
//! `cargo test -p sphereflow-alignment --test brightness -- --nocapture` prints the figures.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

mod scene;

use nalgebra::{Vector2, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, Normal};
use scene::{DT_S, Scene, pinhole, somewhere, twist, two_poses};
use sphereflow_alignment::{Also, Config, VelocityEstimate, VelocityEstimator, twist_from_pose};
use sphereflow_core::{DepthMap, Plane, Pose, TrackStatus, Twist};
use sphereflow_sim::noise::{DepthNoise, IndependentNoise};
use sphereflow_sim::{Motion, Renderer};

/// A frame: depth and brightness.
struct Frame {
    depth: DepthMap,
    grey: Plane<f32>,
}

/// Paint of the world: waves of several lengths, 0 to 255.
fn paint(p: &Vector3<f64>) -> f64 {
    let wave = |a: f64, b: f64, c: f64| (a * p.x + b * p.y + c * p.z).sin();
    128.0 + 30.0 * wave(9.0, 3.0, 2.0) + 30.0 * wave(-4.0, 8.0, 3.0) + 25.0 * wave(3.0, -2.0, 7.0)
}

fn frame(scene: &Scene, pose: &Pose) -> Frame {
    let camera = pinhole();
    let grey = Plane::from_fn(camera.width(), camera.height(), |x, y| {
        let ray = pose.rotation * camera.unproject(&Vector2::new(x as f64, y as f64)).unwrap();
        paint(&(pose.translation + ray * scene.range(&pose.translation, &ray))) as f32
    });
    Frame {
        depth: scene.depths(&camera, pose),
        grey,
    }
}

/// A straight corridor along z without end: two walls, floor and ceiling.
fn corridor() -> Scene {
    Scene::Room(vec![
        (Vector3::x(), 1.2),
        (-Vector3::x(), 1.0),
        (Vector3::y(), 1.3),
        (-Vector3::y(), 1.2),
    ])
}

fn wall() -> Scene {
    Scene::wall(Vector3::new(0.2, 0.1, 1.0), 2.5)
}

fn estimate(frames: &[Frame; 2], with: bool, config: &Config) -> VelocityEstimate {
    try_estimate(frames, with, config).unwrap()
}

fn try_estimate(
    frames: &[Frame; 2],
    with: bool,
    config: &Config,
) -> sphereflow_core::Result<VelocityEstimate> {
    let also = Also {
        brightness: with.then_some((&frames[0].grey, &frames[1].grey)),
        ..Also::default()
    };
    VelocityEstimator::new(&pinhole(), *config)?.estimate_with(
        &frames[0].depth,
        &frames[1].depth,
        DT_S,
        &also,
    )
}

fn frames(scene: &Scene, motion: &Twist) -> [Frame; 2] {
    let (a, b) = two_poses(&somewhere(), motion, DT_S);
    [frame(scene, &a), frame(scene, &b)]
}

/// Errors of omega (rad/s) and v (m/s).
fn errors(found: &VelocityEstimate, truth: &Twist) -> (f64, f64) {
    let found = found.twist.unwrap();
    (
        (found.angular_rad_s - truth.angular_rad_s).norm(),
        (found.linear_m_s - truth.linear_m_s).norm(),
    )
}

/// Thesis: eq. (1.16), with the depth's (1.17): what each lacks the other has.
#[test]
fn brightness_makes_a_wall_and_a_corridor_observable() {
    let motion = twist([0.3, -0.4, 0.2, 0.25, -0.1, 0.3]);
    for (name, scene, unseen) in [("wall", wall(), 3), ("corridor", corridor(), 1)] {
        let frames = frames(&scene, &motion);
        let without = estimate(&frames, false, &Config::default());
        let names: Vec<String> = without
            .weak_directions
            .iter()
            .map(|d| d.to_string())
            .collect();
        println!("{name}, depth alone: {}, {names:?}", without.status);
        assert!(
            matches!(without.status, TrackStatus::Weak(_)),
            "{}",
            without.status
        );
        let held = without.weak_directions.iter().filter(|d| !d.estimated);
        assert_eq!(held.count(), unseen, "{name}: {names:?}");
        assert!(names[0].starts_with("translation along"), "{names:?}");
        let with = estimate(&frames, true, &Config::default());
        let (w, v) = errors(&with, &motion);
        println!(
            "{name}, with brightness: {}, {w:.5} rad/s {v:.5} m/s, score {:.3}",
            with.status, with.score
        );
        assert!(
            with.weak_directions.iter().all(|d| d.estimated),
            "{:?}",
            with.weak_directions
        );
        // waves of some 40 pixels, sampled bilinearly from blocks
        assert!(w < 5e-3 && v < 0.015, "{name}: {w} {v}");
    }
}

#[test]
fn brightness_has_the_sign_of_every_axis() {
    for axis in 0..6 {
        for sign in [1.0, -1.0] {
            let mut values = [0.0; 6];
            values[axis] = 0.3 * sign;
            let motion = twist(values);
            let found = estimate(&frames(&wall(), &motion), true, &Config::default());
            let (w, v) = errors(&found, &motion);
            println!("axis {axis} {sign:+}: {w:.5} rad/s {v:.5} m/s");
            // a twentieth of the motion
            assert!(w < 0.015 && v < 0.015, "axis {axis} {sign}: {w} {v}");
        }
    }
}

#[test]
fn brightness_weighs_nothing_where_its_weight_is_zero() {
    let frames = frames(&Scene::room(), &twist([0.3, -0.4, 0.2, 0.25, -0.1, 0.3]));
    let config = Config {
        brightness_weight: 0.0,
        ..Config::default()
    };
    let (with, without) = (
        estimate(&frames, true, &config),
        estimate(&frames, false, &config),
    );
    assert_eq!(with, without);
}

/// One image as a whole brighter by ten grey levels: exposure.
#[test]
fn brightness_of_another_exposure_is_harmless() {
    let motion = twist([0.3, -0.4, 0.2, 0.25, -0.1, 0.3]);
    let mut frames = frames(&wall(), &motion);
    let before = estimate(&frames, true, &Config::default()).twist.unwrap();
    frames[1].grey = frames[1].grey.map(|y| y + 10.0);
    let after = estimate(&frames, true, &Config::default()).twist.unwrap();
    let change = (after.vector() - before.vector()).norm();
    println!("ten grey levels change the velocity by {change:.2e}");
    // f32 rounding of sums
    assert!(change < 1e-4, "{change}");
}

#[test]
fn brightness_of_wrong_size_is_an_error_that_names_the_image() {
    let mut frames = frames(&wall(), &twist([0.0; 6]));
    let good = std::mem::replace(&mut frames[0].grey, Plane::filled(160, 120, 0.0));
    let error = try_estimate(&frames, true, &Config::default())
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("image0") && error.contains("320x240") && error.contains("160x120"),
        "{error}"
    );
    frames[0].grey = good;
    frames[1].grey = Plane::filled(320, 241, 0.0);
    let error = try_estimate(&frames, true, &Config::default())
        .unwrap_err()
        .to_string();
    assert!(error.contains("image1"), "{error}");
}

/// Unknown brightness takes nothing away from the depth.
#[test]
fn brightness_that_is_unknown_leaves_the_depth_alone() {
    let motion = twist([0.3, -0.4, 0.2, 0.25, -0.1, 0.3]);
    let mut frames = frames(&Scene::room(), &motion);
    let without = estimate(&frames, false, &Config::default());
    for frame in &mut frames {
        frame.grey = Plane::filled(320, 240, f32::NAN);
    }
    assert_eq!(estimate(&frames, true, &Config::default()), without);
}

/// A furnished room with noise of both images: never worse than depth alone, at the default weight.
#[test]
fn brightness_in_a_furnished_room_does_no_harm() {
    const PAIRS: usize = 16;
    const GREY_NOISE: f64 = 3.0; // grey levels
    let camera = pinhole();
    let scene = sphereflow_sim::Scene::furnished_room(1);
    let renderer = Renderer::new(&scene, &camera);
    let noise = DepthNoise::Independent(IndependentNoise::new(3e-3, 0.0, 5).unwrap());
    let motion = Motion::hand_held(3);
    let normal = Normal::new(0.0, GREY_NOISE).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let mut all = [Vec::new(), Vec::new()];
    for i in 0..PAIRS {
        let start_s = 1.2 * i as f64;
        let poses = [start_s, start_s + DT_S].map(|t_s| motion.pose(t_s));
        let truth = twist_from_pose(&(poses[0].inverse() * poses[1]), DT_S);
        let mut index = 2 * i as u64;
        let frames = poses.map(|pose| {
            index += 1;
            let exact = renderer.render(&pose);
            Frame {
                depth: noise.apply(&exact.depth, &camera, index).unwrap(),
                grey: exact.grey.map(|y| y + normal.sample(&mut random) as f32),
            }
        });
        let found = [false, true].map(|with| estimate(&frames, with, &Config::default()));
        let e = [&found[0], &found[1]].map(|found| errors(found, &truth));
        println!(
            "pair {i}: {}, {:.4?} -> {}, {:.4?}",
            found[0].status, e[0], found[1].status, e[1]
        );
        // A view that is weak for both has the prior's errors, and they rule any mean.
        if found[0].status == TrackStatus::Tracked {
            for (all, e) in all.iter_mut().zip(e) {
                all.push(e);
            }
        }
    }
    let rms = |all: &[(f64, f64)]| {
        let mean = |take: fn(&(f64, f64)) -> f64| {
            (all.iter().map(|e| take(e).powi(2)).sum::<f64>() / all.len() as f64).sqrt()
        };
        [mean(|e| e.0), mean(|e| e.1)]
    };
    assert!(all[0].len() >= PAIRS - 2, "{}", all[0].len());
    let [without, with] = all.map(|all| rms(&all));
    println!(
        "furnished room, rms rad/s and m/s: depth alone {without:.4?}, with brightness {with:.4?}"
    );
    assert!(
        with[0] <= without[0] && with[1] <= without[1],
        "{with:?} {without:?}"
    );
}
