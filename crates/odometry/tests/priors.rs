//! What a gyroscope and a known velocity add, and that they are checked.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

#[path = "../../alignment/tests/scene/mod.rs"]
mod scene;

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, Normal};
use scene::{DT_S, Scene, pinhole, somewhere, twist, two_poses};
use sphereflow_alignment::pose_from_twist;
use sphereflow_core::{DepthMap, Stamp, TrackStatus, Twist};
use sphereflow_odometry::{DepthOdometry, Gyro, OdometryConfig};

/// Noise of the inverse depth of each pixel, 1/m.
const NOISE: f64 = 3e-3;

fn motion() -> Twist {
    twist([0.3, -0.4, 0.2, 0.25, -0.1, 0.3])
}

/// Two images of a scene; `seed` 0 has no noise.
fn images(scene: &Scene, seed: u64) -> [DepthMap; 2] {
    let (a, b) = two_poses(&somewhere(), &motion(), DT_S);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let normal = Normal::new(0.0, if seed == 0 { 0.0 } else { NOISE }).unwrap();
    [a, b].map(|pose| {
        let exact = scene.depths(&pinhole(), &pose);
        let mut noisy = |z: &f32| (1.0 / (1.0 / f64::from(*z) + normal.sample(&mut random))) as f32;
        DepthMap::new(exact.metres().map(&mut noisy))
    })
}

#[test]
fn gyro_that_is_not_finite_is_an_error_and_changes_nothing() {
    let mut odometry = DepthOdometry::new(&pinhole(), OdometryConfig::default()).unwrap();
    let exact = images(&Scene::room(), 0);
    odometry.push(&exact[0], Stamp::from_ns(0)).unwrap();
    let stamp = Stamp::from_ns((DT_S * 1e9) as i64);
    for (rate, std_rad_s) in [
        (f64::NAN, 1e-3),
        (0.1, -1.0),
        (0.1, f64::NAN),
        (f64::INFINITY, 0.0),
    ] {
        let gyro = Gyro {
            rate_rad_s: Vector3::repeat(rate),
            std_rad_s,
        };
        let error = odometry
            .push_with_gyro(&exact[1], stamp, Some(gyro))
            .unwrap_err();
        assert!(error.to_string().starts_with("gyro"), "{error}");
    }
    let next = odometry.push(&exact[1], stamp).unwrap();
    assert_eq!(next.status, TrackStatus::Tracked);
}

/// Thesis: Theorem 3: the turn about a wall's normal goes unseen; the gyroscope sees it.
#[test]
fn odometry_before_a_wall_follows_the_turn_about_its_normal_by_gyro() {
    const FRAMES: i64 = 20;
    const FRAME_NS: i64 = 33_333_333;
    let wall = Scene::wall(Vector3::z(), 2.5);
    let turning = twist([0.0, 0.0, 0.5, 0.0, 0.0, 0.1]);
    let pose = |i: i64| pose_from_twist(&turning, (i * FRAME_NS) as f64 * 1e-9);
    for with in [true, false] {
        let mut odometry = DepthOdometry::new(&pinhole(), OdometryConfig::default()).unwrap();
        let mut last = None;
        for i in 0..FRAMES {
            let gyro = Gyro {
                rate_rad_s: turning.angular_rad_s,
                std_rad_s: 1e-3,
            };
            let depth = wall.depths(&pinhole(), &pose(i));
            let stamp = Stamp::from_ns(i * FRAME_NS);
            let found = odometry
                .push_with_gyro(&depth, stamp, with.then_some(gyro))
                .unwrap();
            if i > 0 {
                assert!(
                    matches!(found.status, TrackStatus::Weak(_)),
                    "{}",
                    found.status
                );
            }
            last = Some(found);
        }
        let last = last.unwrap();
        let angle = last
            .world_from_camera
            .rotation
            .angle_to(&pose(FRAMES - 1).rotation);
        let std = last.covariance.unwrap()[(2, 2)].sqrt();
        let names: Vec<String> = last
            .estimate
            .iter()
            .flat_map(|e| e.weak_directions.iter().map(|d| d.to_string()))
            .collect();
        println!("gyro {with}: angle missed {angle:.5} rad, claimed {std:.4} rad/s, {names:?}");
        let turn_unseen = names
            .iter()
            .any(|name| name.starts_with("rotation") && name.contains("not estimated"));
        if with {
            // 1e-3 rad/s over 0.63 s
            assert!(angle < 2e-3, "{angle}");
            assert!(!turn_unseen && names.len() == 2, "{names:?}");
        } else {
            assert!(angle > 0.1 && turn_unseen, "{angle} {names:?}");
        }
    }
}
