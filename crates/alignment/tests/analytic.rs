//! Velocities from exact depth: accuracy, signs and frames, any camera, any thread count.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

mod scene;

use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use scene::{DT_S, Scene, measure, pinhole, somewhere, twist};
use sphereflow_alignment::{Config, Method, VelocityEstimate, VelocityEstimator, twist_from_pose};
use sphereflow_core::{Pose, TrackStatus, Twist};
use sphereflow_sphere::Camera;

/// What exact depth at 30 Hz must give, m/s and rad/s: the acceptance figure of the method.
const EXACT: f64 = 1e-3;
/// One pass without warping is of second order in time and sees creases of the room move: 1 cm and
/// 1 degree per frame cost this, m/s and rad/s.
const EXACT_SINGLE_PASS: f64 = 3e-3;

fn single_pass() -> Config {
    Config::of(Method::Single)
}

fn errors(estimate: &VelocityEstimate, truth: &Twist) -> (f64, f64) {
    let found = estimate
        .twist
        .unwrap_or_else(|| panic!("{}", estimate.status));
    let angular = (found.angular_rad_s - truth.angular_rad_s).norm();
    (angular, (found.linear_m_s - truth.linear_m_s).norm())
}

fn general_motion() -> Twist {
    twist([0.3, -0.4, 0.2, 0.25, -0.1, 0.3])
}

/// Thesis: eq. (6.3), eq. (1.17): signs and frames of all six velocities.
#[test]
fn estimate_each_axis_alone_has_its_sign_and_frame() {
    for config in [single_pass(), Config::default()] {
        for axis in 0..12 {
            let mut values = [0.0; 6];
            values[axis % 6] = if axis < 6 { 0.3 } else { -0.3 };
            let motion = twist(values);
            let estimate = measure(&Scene::room(), &pinhole(), &motion, &config);
            let (w, v) = errors(&estimate, &motion);
            assert!(w < EXACT && v < EXACT, "axis {axis}: {w} rad/s, {v} m/s");
            assert_eq!(estimate.status, TrackStatus::Tracked);
        }
    }
}

/// Thesis: section 6.2, section 6.3: one weak form for every central camera.
#[test]
fn estimate_general_motion_is_exact_for_every_camera() {
    let (f, c) = (290.0, (159.5, 119.5));
    let lens = [0.26, -0.95, -0.005, 0.003, 1.16, 0.0, 0.0, 0.0];
    let cameras = [
        ("pinhole", pinhole()),
        (
            "distorted",
            Camera::opencv(f, f, c.0, c.1, lens, 320, 240).unwrap(),
        ),
        (
            "FOV fish-eye",
            Camera::fov(160.0, 160.0, c.0, c.1, 0.9, 320, 240).unwrap(),
        ),
        (
            "fish-eye",
            Camera::kannala_brandt(110.0, 110.0, c.0, c.1, [0.01, -0.003, 0.0, 0.0], 320, 240)
                .unwrap(),
        ),
        ("360 degrees", Camera::equirectangular(512, 256).unwrap()),
    ];
    let motion = general_motion();
    for (name, camera) in cameras {
        for (config, bound) in [
            (single_pass(), EXACT_SINGLE_PASS),
            (Config::default(), EXACT),
        ] {
            let estimate = measure(&Scene::room(), &camera, &motion, &config);
            let (w, v) = errors(&estimate, &motion);
            println!(
                "{name}, {} levels: {w:.1e} rad/s {v:.1e} m/s, score {:.3}",
                config.levels, estimate.score
            );
            assert!(w < bound && v < bound, "{name}: {w} rad/s, {v} m/s");
        }
    }
}

/// Invariance under SO(3): a 360-degree camera turned within the scene measures the same motion,
/// turned.
#[test]
fn estimate_of_turned_camera_is_the_turned_estimate() {
    let camera = Camera::equirectangular(512, 256).unwrap();
    let turn = UnitQuaternion::from_euler_angles(0.7, -1.1, 2.0);
    let motion = general_motion();
    let (a, b) = scene::two_poses(&somewhere(), &motion, DT_S);
    let turned = |pose: &Pose| Pose::new(pose.rotation * turn, pose.translation);
    let room = Scene::room();
    let images = [turned(&a), turned(&b)].map(|pose| room.ranges(&camera, &pose));
    let mut estimator = VelocityEstimator::new(&camera, Config::default()).unwrap();
    let found = estimator
        .estimate(&images[0], &images[1], DT_S)
        .unwrap()
        .twist
        .unwrap();
    let expected = twist_from_pose(&(turned(&a).inverse() * turned(&b)), DT_S);
    let back: Rotation3<f64> = turn.to_rotation_matrix();
    assert!(
        (back * expected.linear_m_s - motion.linear_m_s).norm() < 1e-9,
        "the test's own frames"
    );
    assert!((back * found.angular_rad_s - motion.angular_rad_s).norm() < EXACT);
    assert!((back * found.linear_m_s - motion.linear_m_s).norm() < EXACT);
}

/// Fast motion: 6 cm and 4 degrees between the images.
#[test]
fn estimate_of_fast_motion_needs_warping_and_is_exact_with_it() {
    let motion = twist([1.0, -1.5, 0.8, 1.2, -0.6, 1.0]);
    let config = Config::default();
    let (w, v) = errors(
        &measure(&Scene::room(), &pinhole(), &motion, &config),
        &motion,
    );
    assert!(w < EXACT && v < EXACT, "{w} rad/s, {v} m/s");
    let (w1, v1) = errors(
        &measure(&Scene::room(), &pinhole(), &motion, &single_pass()),
        &motion,
    );
    assert!(w1 > w && v1 > v, "{w1} rad/s, {v1} m/s without warping");
}

#[test]
fn estimate_ignores_an_object_that_moves_otherwise() {
    /// A sixth of the view misleads, all of it in the same way: what the robust weights leave of it, m/s and rad/s.
    const REJECTED: f64 = 5e-3;
    let motion = general_motion();
    let (a, b) = scene::two_poses(&somewhere(), &motion, DT_S);
    let camera = pinhole();
    let images = [a, b].map(|pose| {
        let mut metres = Scene::room().depths(&camera, &pose).into_plane();
        for y in 120..240 {
            for x in 220..320 {
                // a slanted board carried along with the camera
                metres[(x, y)] = 1.0 + 0.002 * x as f32 + 0.001 * y as f32;
            }
        }
        sphereflow_core::DepthMap::new(metres)
    });
    let mut estimator = VelocityEstimator::new(&camera, Config::default()).unwrap();
    let (w, v) = errors(
        &estimator.estimate(&images[0], &images[1], DT_S).unwrap(),
        &motion,
    );
    assert!(w < REJECTED && v < REJECTED, "{w} rad/s, {v} m/s");
}

#[test]
fn estimate_does_not_depend_on_the_thread_count() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            measure(
                &Scene::room(),
                &pinhole(),
                &general_motion(),
                &Config::default(),
            )
        })
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn estimate_a_second_time_with_the_same_workspace_is_the_same() {
    let (a, b) = scene::two_poses(&somewhere(), &general_motion(), DT_S);
    let camera = pinhole();
    let (a, b) = (
        Scene::room().depths(&camera, &a),
        Scene::room().depths(&camera, &b),
    );
    let mut estimator = VelocityEstimator::new(&camera, Config::default()).unwrap();
    let once = estimator.estimate(&a, &b, DT_S).unwrap();
    let back = estimator.estimate(&b, &a, DT_S).unwrap();
    assert_eq!(estimator.estimate(&a, &b, DT_S).unwrap(), once);
    // Reversed in time, the twist in the camera's own frame changes its sign only.
    let sum: Vector3<f64> = once.twist.unwrap().linear_m_s + back.twist.unwrap().linear_m_s;
    assert!(sum.norm() < 2.0 * EXACT, "{sum}");
}
