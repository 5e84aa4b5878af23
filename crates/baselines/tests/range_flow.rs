//! The point-wise peer: signs and frames, any camera, noise, and what it must not claim.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

#[path = "../../alignment/tests/scene/mod.rs"]
mod scene;

use nalgebra::{UnitQuaternion, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, Normal};
use scene::{DT_S, Scene, pinhole, somewhere, twist, two_poses};
use sphereflow_alignment::{CovarianceModel, VelocityEstimate, pose_from_twist};
use sphereflow_baselines::{RangeFlow, RangeFlowConfig};
use sphereflow_core::{DepthMap, Plane, Pose, Reason, TrackStatus, Twist};
use sphereflow_sphere::Camera;

/// What exact depth at 30 Hz must give, m/s and rad/s: as asked of the weak form.
const EXACT: f64 = 1e-3;

fn flow(camera: &Camera) -> RangeFlow {
    RangeFlow::new(camera, RangeFlowConfig::default()).unwrap()
}

fn general_motion() -> Twist {
    twist([0.3, -0.4, 0.2, 0.25, -0.1, 0.3])
}

/// The estimate from two exact images: ranges where `along_ray`.
fn measure(scene: &Scene, camera: &Camera, motion: &Twist, along_ray: bool) -> VelocityEstimate {
    let (a, b) = two_poses(&somewhere(), motion, DT_S);
    if along_ray {
        let (a, b) = (scene.ranges(camera, &a), scene.ranges(camera, &b));
        flow(camera).estimate(&a, &b, DT_S).unwrap()
    } else {
        let (a, b) = (scene.depths(camera, &a), scene.depths(camera, &b));
        flow(camera).estimate(&a, &b, DT_S).unwrap()
    }
}

fn errors(estimate: &VelocityEstimate, truth: &Twist) -> (f64, f64) {
    let found = estimate
        .twist
        .unwrap_or_else(|| panic!("{}", estimate.status));
    let angular = (found.angular_rad_s - truth.angular_rad_s).norm();
    (angular, (found.linear_m_s - truth.linear_m_s).norm())
}

/// Thesis: eq. (1.17): signs and frames of all six velocities, point by point.
#[test]
fn range_flow_each_axis_alone_has_its_sign_and_frame() {
    for axis in 0..12 {
        let mut values = [0.0; 6];
        values[axis % 6] = if axis < 6 { 0.3 } else { -0.3 };
        let motion = twist(values);
        let estimate = measure(&Scene::room(), &pinhole(), &motion, false);
        let (w, v) = errors(&estimate, &motion);
        assert!(w < EXACT && v < EXACT, "axis {axis}: {w} rad/s, {v} m/s");
        assert_eq!(estimate.status, TrackStatus::Tracked);
    }
}

#[test]
fn range_flow_general_motion_is_exact_for_every_camera() {
    let (f, c) = (290.0, (159.5, 119.5));
    let lens = [0.26, -0.95, -0.005, 0.003, 1.16, 0.0, 0.0, 0.0];
    let cameras = [
        ("pinhole", pinhole(), false),
        ("pinhole, ranges", pinhole(), true),
        (
            "distorted",
            Camera::opencv(f, f, c.0, c.1, lens, 320, 240).unwrap(),
            false,
        ),
        (
            "FOV fish-eye",
            Camera::fov(160.0, 160.0, c.0, c.1, 0.9, 320, 240).unwrap(),
            false,
        ),
        (
            "360 degrees",
            Camera::equirectangular(512, 256).unwrap(),
            true,
        ),
    ];
    for (name, camera, along_ray) in cameras {
        let estimate = measure(&Scene::room(), &camera, &general_motion(), along_ray);
        let (w, v) = errors(&estimate, &general_motion());
        assert!(w < EXACT && v < EXACT, "{name}: {w} rad/s, {v} m/s");
    }
}

/// Fast motion needs the coarse levels and the warps: 1 m/s and 1.4 rad/s.
#[test]
fn range_flow_fast_motion_converges() {
    /// m/s and rad/s: as asked of the weak form.
    const FAST: f64 = 5e-3;
    let motion = twist([0.8, -1.0, 0.6, 0.6, -0.5, 0.6]);
    let estimate = measure(&Scene::room(), &pinhole(), &motion, false);
    let (w, v) = errors(&estimate, &motion);
    assert!(w < FAST && v < FAST, "{w} rad/s, {v} m/s");
}

fn noisy(exact: &DepthMap, seed: u64) -> DepthMap {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let noise = Normal::new(0.0, 1.5e-3).unwrap(); // Kinect: 1/m, flat in range
    let (width, height) = exact.size();
    let metres = exact.metres().data();
    DepthMap::new(Plane::from_fn(width, height, |x, y| {
        let inverse = 1.0 / f64::from(metres[y * width + x]);
        (1.0 / (inverse + noise.sample(&mut random))) as f32
    }))
}

/// Errors over the standard deviations claimed, squared, and the errors themselves.
fn noisy_runs(count: u64) -> Vec<(f64, f64, f64)> {
    let motion = general_motion();
    let (a, b) = two_poses(&somewhere(), &motion, DT_S);
    let room = Scene::room();
    let (a, b) = (room.depths(&pinhole(), &a), room.depths(&pinhole(), &b));
    let config = RangeFlowConfig {
        // Without the floors for real cameras; the factor stays, as neighbours share their gradients.
        covariance: CovarianceModel {
            floor_m: 0.0,
            motion_share: 0.0,
            ..CovarianceModel::default()
        },
        ..RangeFlowConfig::default()
    };
    let mut flow = RangeFlow::new(&pinhole(), config).unwrap();
    let run = |seed: u64| {
        let (a, b) = (noisy(&a, 2 * seed), noisy(&b, 2 * seed + 1));
        let found = flow.estimate(&a, &b, DT_S).unwrap();
        assert_eq!(found.status, TrackStatus::Tracked);
        let (w, v) = errors(&found, &motion);
        let miss = found.twist.unwrap().vector() - motion.vector();
        let claimed = found.covariance.unwrap().try_inverse().unwrap();
        (w, v, miss.dot(&(claimed * miss)))
    };
    (0..count).map(run).collect()
}

#[test]
fn range_flow_with_noise_is_near_the_truth_and_within_its_covariance() {
    /// Medians, m/s and rad/s, of 320x240 in a convex room at 33 ms.
    const NOISY: (f64, f64) = (0.02, 0.04);
    let mut runs = noisy_runs(20);
    let mut median = |part: fn(&(f64, f64, f64)) -> f64| {
        runs.sort_by(|a, b| part(a).total_cmp(&part(b)));
        part(&runs[runs.len() / 2])
    };
    let (w, v, squared) = (median(|r| r.0), median(|r| r.1), median(|r| r.2));
    println!("median {w} rad/s, {v} m/s, normalised squared {squared}");
    assert!(w < NOISY.0 && v < NOISY.1, "{w} rad/s, {v} m/s");
    assert!((2.0..12.0).contains(&squared), "{squared}, 5.35 is ideal");
}

#[test]
fn range_flow_does_not_depend_on_the_number_of_threads() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| measure(&Scene::room(), &pinhole(), &general_motion(), false))
    };
    // As text: a field that it does not fill is NaN.
    assert_eq!(format!("{:?}", run(1)), format!("{:?}", run(4)));
}

/// A guess of the motion, as a keyframe's tracker has one, reaches further.
#[test]
fn range_flow_from_a_guess_bridges_a_long_way() {
    let moved = pose_from_twist(&twist([0.15, -0.3, 0.2, 0.2, -0.1, 0.25]), 1.0);
    let turn = Pose::new(
        UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.03, 0.0)),
        Vector3::new(0.02, 0.0, 0.0),
    );
    let room = Scene::room();
    let (a, b) = (
        room.depths(&pinhole(), &somewhere()),
        room.depths(&pinhole(), &(somewhere() * moved)),
    );
    let guess = moved * turn;
    let found = flow(&pinhole()).estimate_from(&a, &b, 1.0, &guess).unwrap();
    let (w, v) = errors(&found, &twist([0.15, -0.3, 0.2, 0.2, -0.1, 0.25]));
    assert!(w < EXACT && v < EXACT, "{w} rad, {v} m");
}

/// Noise gives a wall gradients along itself: they must not pass for knowledge.
#[test]
fn range_flow_before_one_wall_is_weak_with_noise_and_without() {
    let (a, b) = two_poses(&somewhere(), &general_motion(), DT_S);
    let wall = Scene::wall(Vector3::new(0.2, 0.1, 1.0), 2.5);
    let (a, b) = (wall.depths(&pinhole(), &a), wall.depths(&pinhole(), &b));
    for (a, b) in [(a.clone(), b.clone()), (noisy(&a, 1), noisy(&b, 2))] {
        let found = flow(&pinhole()).estimate(&a, &b, DT_S).unwrap();
        let weak = matches!(found.status, TrackStatus::Weak(Reason::Unobservable { .. }));
        assert!(weak, "{} {}", found.status, found.score);
        assert!(found.weak_directions.len() >= 3, "{found:?}");
    }
}

#[test]
fn range_flow_without_an_answer_is_lost_and_has_no_twist() {
    let filled = |metres: f32| DepthMap::new(Plane::filled(320, 240, metres));
    let view = Scene::room().depths(&pinhole(), &somewhere());
    for nothing in [f32::NAN, 0.0, -1.0, f32::INFINITY] {
        let lost = flow(&pinhole())
            .estimate(&filled(nothing), &view, DT_S)
            .unwrap();
        assert!(
            matches!(
                lost.status,
                TrackStatus::Lost(Reason::FewKnownPixels { .. })
            ),
            "{nothing}: {}",
            lost.status
        );
        assert!(lost.twist.is_none() && lost.covariance.is_none());
    }
    // Another part of the room: nothing in common.
    let turned = Pose::new(
        UnitQuaternion::from_euler_angles(0.0, 2.0, 0.0),
        Vector3::zeros(),
    );
    let other = Scene::room().depths(&pinhole(), &(somewhere() * turned));
    let apart = flow(&pinhole()).estimate(&view, &other, DT_S).unwrap();
    assert!(
        matches!(apart.status, TrackStatus::Lost(_)) && apart.twist.is_none(),
        "{}",
        apart.status
    );
}

#[test]
fn range_flow_with_bad_arguments_is_an_error_that_names_them() {
    let camera = pinhole();
    let view = Scene::room().depths(&camera, &somewhere());
    for dt_s in [0.0, -0.1, f64::NAN] {
        let error = flow(&camera).estimate(&view, &view, dt_s).unwrap_err();
        assert!(error.to_string().contains("dt_s"), "{error}");
    }
    let small = DepthMap::new(Plane::filled(160, 120, 2.0));
    let error = flow(&camera).estimate(&view, &small, DT_S).unwrap_err();
    let text = error.to_string();
    assert!(
        text.contains("depth1") && text.contains("160x120"),
        "{text}"
    );
    let ranges = Scene::room().ranges(&camera, &somewhere());
    let error = flow(&camera).estimate(&view, &ranges, DT_S).unwrap_err();
    assert!(error.to_string().contains("depth1"), "{error}");
}
