//! What a scene cannot tell, and what the estimator claims to know: Theorem 3 and the covariance.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

mod scene;

use nalgebra::{Matrix6, Vector3, Vector6};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, Normal};
use scene::{DT_S, Scene, measure, pinhole, somewhere, twist, two_poses};
use sphereflow_alignment::{
    Config, CovarianceModel, VelocityEstimate, WeakDirection, estimate_velocity, pose_from_twist,
};
use sphereflow_core::{DepthMap, Reason, TrackStatus, Twist};
use sphereflow_sphere::Camera;

/// Directions of exact scenes, as shares of a unit vector: one degree.
const ONE_DEGREE: f64 = 0.0175;

fn motion() -> Twist {
    twist([0.3, -0.4, 0.2, 0.25, -0.1, 0.3])
}

fn parts(direction: &WeakDirection) -> (Vector3<f64>, Vector3<f64>) {
    let twist = Twist::from_vector(&direction.direction);
    (twist.angular_rad_s, twist.linear_m_s)
}

fn assert_unobservable(estimate: &VelocityEstimate, dimensions: usize, name: &str) {
    let is_weak = matches!(estimate.status, TrackStatus::Weak(Reason::Unobservable { score }) if score < 0.01);
    assert!(is_weak, "{name}: {}", estimate.status);
    let unseen = estimate
        .weak_directions
        .iter()
        .filter(|d| !d.estimated)
        .count();
    assert_eq!(unseen, dimensions, "{name}: {:?}", estimate.weak_directions);
}

/// Thesis: Theorem 3, for a camera that sees one wall: three motions slide it on itself.
#[test]
fn estimate_before_one_wall_is_weak_along_the_wall_and_right_across_it() {
    /// m/s: exact depth.
    const EXACT: f64 = 1e-3;
    let normal = Vector3::new(0.2, 0.1, 1.0).normalize();
    let estimate = measure(
        &Scene::wall(normal, 2.5),
        &pinhole(),
        &motion(),
        &Config::default(),
    );
    assert_unobservable(&estimate, 3, "wall");
    let normal = somewhere().rotation.inverse() * normal; // in the camera's frame
    for direction in estimate.weak_directions.iter().filter(|d| !d.estimated) {
        let (omega, v) = parts(direction);
        let turns_wall = (omega.cross(&normal) * estimate.mean_range_m).norm();
        assert!(
            turns_wall < ONE_DEGREE && v.dot(&normal).abs() < ONE_DEGREE,
            "{direction:?}"
        );
    }
    // What is seen of the motion: where the wall of the second image lies in the first.
    let (a, b) = two_poses(&somewhere(), &motion(), DT_S);
    let found = pose_from_twist(&estimate.twist.unwrap(), DT_S);
    let world_normal = a.rotation * normal;
    let turned = found.rotation * (b.rotation.inverse() * world_normal);
    let moved = (b.translation - a.translation).dot(&world_normal) - found.translation.dot(&normal);
    assert!(
        (turned - normal).norm() < EXACT * DT_S && moved.abs() < EXACT * DT_S,
        "{turned} {moved}"
    );
    let claimed = estimate.covariance.unwrap().diagonal();
    assert!(
        claimed.max() > 0.2,
        "an unseen velocity must not look known: {claimed}"
    );
}

/// Thesis: Theorem 3: the sphere turns about its centre unseen, whatever the axis.
#[test]
fn estimate_inside_a_sphere_is_weak_about_its_centre() {
    let centre = Vector3::new(0.3, 0.2, 0.4);
    let in_camera = somewhere().inverse().transform(&centre);
    for camera in [pinhole(), Camera::equirectangular(512, 256).unwrap()] {
        let estimate = measure(
            &Scene::Sphere(centre, 2.0),
            &camera,
            &motion(),
            &Config::default(),
        );
        assert_unobservable(&estimate, 3, "sphere");
        for direction in estimate.weak_directions.iter().filter(|d| !d.estimated) {
            let (omega, v) = parts(direction);
            let moves_centre = (v + omega.cross(&in_camera)).norm();
            assert!(moves_centre < ONE_DEGREE, "{moves_centre} {direction:?}");
        }
    }
}

/// Thesis: Theorem 3: an ellipsoid of revolution has one rotation axis, one of three axes none.
#[test]
fn estimate_inside_ellipsoids_counts_their_rotation_axes() {
    let camera = Camera::equirectangular(512, 256).unwrap();
    let spheroid = Scene::Ellipsoid(Vector3::new(2.0, 1.5, 2.0));
    let estimate = measure(&spheroid, &camera, &motion(), &Config::default());
    assert_unobservable(&estimate, 1, "spheroid");
    let (omega, v) = parts(&estimate.weak_directions[0]);
    let axis = somewhere().rotation.inverse() * Vector3::y();
    let aside = omega.cross(&axis).norm() / omega.norm();
    let centre = somewhere().inverse().transform(&Vector3::zeros());
    assert!(
        aside < ONE_DEGREE && (v + omega.cross(&centre)).norm() < ONE_DEGREE,
        "{aside}"
    );
    let three = Scene::Ellipsoid(Vector3::new(2.0, 1.5, 2.5));
    let estimate = measure(&three, &camera, &motion(), &Config::default());
    assert_eq!(estimate.status, TrackStatus::Tracked);
}

/// Squared errors in units of the covariance, without the floors for real cameras, on images with
/// independent noise.
///
/// Thesis: section 6.4: "the covariance of the result".
#[test]
fn estimate_covariance_agrees_with_the_errors_under_independent_noise() {
    const PAIRS: u64 = 40;
    const NOISE: f64 = 1.5e-3; // of the inverse depth, 1/m
    let config = Config {
        covariance: CovarianceModel {
            scale: 1.0,
            floor_m: 0.0,
            motion_share: 0.0,
        },
        ..Config::default()
    };
    let camera = pinhole();
    let (a, b) = two_poses(&somewhere(), &motion(), DT_S);
    let exact = [
        Scene::room().depths(&camera, &a),
        Scene::room().depths(&camera, &b),
    ];
    let normal = Normal::new(0.0, NOISE).unwrap();
    let mut sum = 0.0;
    for seed in 0..PAIRS {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let noisy = [0, 1].map(|i: usize| {
            let plane = exact[i]
                .metres()
                .map(|z| (1.0 / (1.0 / f64::from(*z) + normal.sample(&mut random))) as f32);
            DepthMap::new(plane)
        });
        let estimate = estimate_velocity(&camera, &noisy[0], &noisy[1], DT_S, &config).unwrap();
        let error: Vector6<f64> = estimate.twist.unwrap().vector() - motion().vector();
        let information: Matrix6<f64> = estimate.covariance.unwrap().try_inverse().unwrap();
        sum += error.dot(&(information * error));
    }
    let mean = sum / PAIRS as f64;
    println!("mean squared error over covariance: {mean:.2} (6 is ideal)");
    // Six degrees of freedom; neighbours share the noise of their common edges, which the solve
    // does not know of.
    assert!((4.0..12.0).contains(&mean), "{mean}");
}

#[test]
fn estimate_covariance_floor_is_the_one_that_was_set() {
    let model = CovarianceModel {
        scale: 1.0,
        floor_m: 0.01,
        motion_share: 0.0,
    };
    let config = Config {
        covariance: model,
        ..Config::default()
    };
    let estimate = measure(&Scene::room(), &pinhole(), &motion(), &config);
    let std = estimate.covariance.unwrap()[(5, 5)].sqrt();
    // exact depth: nothing but the floor
    assert!((std * DT_S - 0.01).abs() < 1e-4, "{std}");
}
