//! What a gyroscope and a known velocity add, and that they are checked.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

mod scene;

use nalgebra::{Matrix6, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, Normal};
use scene::{DT_S, Scene, pinhole, somewhere, twist, two_poses};
use sphereflow_alignment::{Also, Config, VelocityEstimate, VelocityEstimator, VelocityPrior};
use sphereflow_core::{DepthMap, TrackStatus, Twist};

/// Noise of the inverse depth of each pixel, 1/m.
const NOISE: f64 = 3e-3;
/// Errors on exact depth, m/s and rad/s.
const EXACT: f64 = 1e-3;

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

fn estimate(images: &[DepthMap; 2], prior: Option<VelocityPrior>) -> VelocityEstimate {
    try_estimate(images, prior).unwrap()
}

fn try_estimate(
    images: &[DepthMap; 2],
    prior: Option<VelocityPrior>,
) -> sphereflow_core::Result<VelocityEstimate> {
    let also = Also {
        prior,
        ..Also::default()
    };
    VelocityEstimator::new(&pinhole(), Config::default())?
        .estimate_with(&images[0], &images[1], DT_S, &also)
}

/// A rotation held fixed: small beside what images can tell, and far from rounding errors, rad/s.
const FIXED_STD: f64 = 1e-5;

/// A right gyroscope; 0 holds the rotation fixed.
fn gyro(std_rad_s: f64) -> VelocityPrior {
    VelocityPrior::of_gyro(motion().angular_rad_s, std_rad_s.max(FIXED_STD))
}

/// Errors of omega and v.
fn errors(found: &VelocityEstimate) -> (f64, f64) {
    let found = found.twist.unwrap();
    let truth = motion();
    (
        (found.angular_rad_s - truth.angular_rad_s).norm(),
        (found.linear_m_s - truth.linear_m_s).norm(),
    )
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let squares: Vec<f64> = values.map(|v| v * v).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn gyro_as_prior_and_fixed_leaves_exact_depth_exact() {
    let exact = images(&Scene::room(), 0);
    for std_rad_s in [3e-3, 0.0] {
        let found = estimate(&exact, Some(gyro(std_rad_s)));
        let (w, v) = errors(&found);
        assert_eq!(found.status, TrackStatus::Tracked);
        assert!(w < EXACT && v < EXACT, "{std_rad_s}: {w} {v}");
    }
}

#[test]
fn gyro_held_fixed_is_the_rotation_found_even_where_it_is_wrong() {
    let rate = motion().angular_rad_s + Vector3::new(0.02, 0.0, -0.01);
    let wrong = VelocityPrior::of_gyro(rate, FIXED_STD);
    let found = estimate(&images(&Scene::room(), 0), Some(wrong));
    let apart = (found.twist.unwrap().angular_rad_s - rate).norm();
    assert!(apart < 1e-4, "{apart}");
}

/// Rotation and translation are coupled: who knows the one sees the other better.
#[test]
fn gyro_on_noisy_depth_halves_the_errors() {
    const SEEDS: std::ops::Range<u64> = 1..25;
    let all = |prior: Option<VelocityPrior>| -> (f64, f64) {
        let found: Vec<_> = SEEDS
            .map(|seed| errors(&estimate(&images(&Scene::room(), seed), prior)))
            .collect();
        (
            rms(found.iter().map(|e| e.0)),
            rms(found.iter().map(|e| e.1)),
        )
    };
    let (without, with, fixed) = (all(None), all(Some(gyro(1e-3))), all(Some(gyro(0.0))));
    println!("rad/s, m/s: without gyro {without:?}, 1e-3 rad/s {with:?}, fixed {fixed:?}");
    assert!(with.0 < 0.5 * without.0 && fixed.0 < 1e-4);
    assert!(with.1 < 0.8 * without.1 && fixed.1 < 0.8 * without.1);
}

#[test]
fn velocity_prior_of_little_weight_does_not_bias() {
    let exact = images(&Scene::room(), 0);
    let wrong = VelocityPrior::of_gyro(Vector3::new(1.0, 1.0, -1.0), 100.0)
        .and_linear(Vector3::new(-1.0, 1.0, 0.5), 100.0);
    let (w, v) = errors(&estimate(&exact, Some(wrong)));
    assert!(w < EXACT && v < EXACT, "{w} {v}");
}

/// Of a wall the depth tells three directions, the prior the others.
#[test]
fn priors_before_a_wall_fill_what_it_hides() {
    let wall = Scene::wall(Vector3::new(0.2, 0.1, 1.0), 2.5);
    for seed in [0, 1] {
        let known = gyro(1e-3).and_linear(motion().linear_m_s, 0.01);
        let found = estimate(&images(&wall, seed), Some(known));
        let (w, v) = errors(&found);
        println!(
            "wall with priors, seed {seed}: {w:.5} rad/s {v:.5} m/s, {}",
            found.status
        );
        assert!(
            found.weak_directions.iter().all(|d| d.estimated),
            "{:?}",
            found.weak_directions
        );
        // three times what the priors and the noise allow
        assert!(w < 0.01 && v < 0.04, "{w} {v}");
    }
}

#[test]
fn velocity_prior_is_what_noise_leaves_open() {
    let known = VelocityPrior::none().and_linear(motion().linear_m_s, 1e-3);
    let (w, v) = errors(&estimate(&images(&Scene::room(), 3), Some(known)));
    // three standard deviations of three components
    assert!(v < 5e-3 && w < 0.02, "{w} {v}");
}

#[test]
fn prior_that_is_no_information_is_an_error_that_names_it() {
    let exact = images(&Scene::room(), 0);
    let good = gyro(1e-3);
    let mut bad = [good; 5];
    bad[0].information[(1, 1)] = f64::NAN;
    bad[1].information[(0, 3)] = 1e6; // not symmetric
    bad[2].information[(5, 5)] = -1e6;
    bad[3].twist.linear_m_s.x = f64::INFINITY;
    bad[4].information = Matrix6::repeat(f64::INFINITY);
    for prior in bad {
        let error = try_estimate(&exact, Some(prior)).unwrap_err().to_string();
        assert!(error.starts_with("prior"), "{error}");
    }
}
