//! The thesis's method on exact depth: accuracy, order in time, what it says of bad input.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

#[path = "../../alignment/tests/scene/mod.rs"]
mod scene;

use nalgebra::{Vector3, Vector6};
use scene::{DT_S, Scene, pinhole, somewhere, twist, two_poses};
use sphereflow_alignment::{Config, VelocityEstimate};
use sphereflow_baselines::{RowWeights, ThesisConfig, ThesisEstimator, TimeRule};
use sphereflow_core::{DepthMap, Plane, Reason, TrackStatus, Twist};
use sphereflow_sphere::Camera;

/// 10 cm/s and 6 deg/s: on exact depth of a convex room, m/s and rad/s. Creases that cross a domain's
/// border between the images leave so much.
const EXACT: f64 = 2e-3;

fn motion() -> Twist {
    twist([0.1, -0.08, 0.05, 0.1, -0.05, 0.12])
}

fn images(scene: &Scene, camera: &Camera, motion: &Twist, dt_s: f64) -> (DepthMap, DepthMap) {
    let (a, b) = two_poses(&somewhere(), motion, dt_s);
    (scene.depths(camera, &a), scene.depths(camera, &b))
}

fn run(
    scene: &Scene,
    camera: &Camera,
    motion: &Twist,
    dt_s: f64,
    config: ThesisConfig,
) -> VelocityEstimate {
    let (a, b) = images(scene, camera, motion, dt_s);
    let mut estimator = ThesisEstimator::new(camera, config).unwrap();
    estimator.estimate(&a, &b, dt_s).unwrap()
}

/// Errors of omega and v.
fn errors(estimate: &VelocityEstimate, truth: &Twist) -> (f64, f64) {
    let found = estimate
        .twist
        .unwrap_or_else(|| panic!("{}", estimate.status));
    let angular = (found.angular_rad_s - truth.angular_rad_s).norm();
    (angular, (found.linear_m_s - truth.linear_m_s).norm())
}

fn fish_eye() -> Camera {
    Camera::fov(160.0, 160.0, 159.5, 119.5, 0.9, 320, 240).unwrap()
}

/// Thesis: eq. (6.3), section 6.2, section 6.3: both cameras that have a table, signs of all six.
#[test]
fn thesis_estimate_of_each_axis_has_its_sign_and_frame() {
    for camera in [pinhole(), fish_eye()] {
        for axis in 0..12 {
            let mut values = [0.0; 6];
            values[axis % 6] = if axis < 6 { 0.1 } else { -0.1 };
            let motion = twist(values);
            let config = ThesisConfig {
                weights: RowWeights::DomainNoise,
                ..ThesisConfig::default()
            };
            let estimate = run(&Scene::room(), &camera, &motion, DT_S, config);
            let (w, v) = errors(&estimate, &motion);
            assert!(w < EXACT && v < EXACT, "axis {axis}: {w} rad/s, {v} m/s");
            assert_eq!(estimate.status, TrackStatus::Tracked);
        }
    }
}

/// Thesis: eq. (6.3): the printed time difference against the contour of the first image is of
/// first order in dt, against the mean of both images of second.
#[test]
fn thesis_forward_is_of_first_order_and_trapezoid_of_second() {
    // A smooth scene: no crease crosses a border.
    let scene = Scene::Ellipsoid(Vector3::new(2.0, 1.5, 2.5));
    // 640 x 480 for the pixels' own error not to show.
    let camera = Camera::pinhole(580.0, 580.0, 319.5, 239.5, 640, 480).unwrap();
    let motion = twist([0.3, -0.4, 0.2, 0.25, -0.1, 0.3]);
    let mut table = Vec::new();
    for time in [TimeRule::Forward, TimeRule::Trapezoid] {
        // Poorly seen directions of the smooth scene are kept: the depth is exact.
        let limits = Config {
            unobservable_score: 1e-9,
            ..Config::default()
        };
        let config = ThesisConfig {
            time,
            limits,
            ..ThesisConfig::default()
        };
        let found = [0.4, 0.2, 0.1].map(|dt_s| {
            let estimate = run(&scene, &camera, &motion, dt_s, config);
            let (w, v) = errors(&estimate, &motion);
            println!("{time:?}, dt {dt_s}: {w:.2e} rad/s {v:.2e} m/s");
            w.hypot(v)
        });
        table.push(found);
    }
    for (found, order) in table.iter().zip([1.0, 2.0]) {
        for pair in found.windows(2) {
            let slope = (pair[0] / pair[1]).log2();
            assert!((slope - order).abs() < 0.4, "{slope} for {order}");
        }
    }
}

/// Thesis: section 6.4: the printed recipe at the thesis's numbers of domains, tiled or
/// overlapping.
#[test]
fn thesis_estimate_of_a_convex_room_is_right_for_any_number_of_domains() {
    let motion = motion();
    let camera = Camera::pinhole(580.0, 580.0, 319.5, 239.5, 640, 480).unwrap();
    for overlap in [false, true] {
        for domains in [40, 100, 200, 500, 1000] {
            let config = ThesisConfig {
                domains,
                overlap,
                ..ThesisConfig::default()
            };
            let estimate = run(&Scene::room(), &camera, &motion, DT_S, config);
            let (w, v) = errors(&estimate, &motion);
            println!(
                "convex room, {} domains{}: {w:.1e} rad/s {v:.1e} m/s",
                estimate.domains,
                if overlap { ", overlapping" } else { "" }
            );
            assert!(w < EXACT && v < EXACT, "{domains}: {w} rad/s, {v} m/s");
        }
    }
}

#[test]
fn thesis_estimate_does_not_depend_on_the_thread_count() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let config = ThesisConfig::default();
        pool.install(|| run(&Scene::room(), &pinhole(), &motion(), DT_S, config))
    };
    // As text, which holds every digit: a field that was not measured is NaN, equal to nothing.
    assert_eq!(format!("{:?}", run(1)), format!("{:?}", run(3)));
}

/// Thesis: Theorem 3: one wall lets three motions go unseen: they are not answered with zero but
/// with a status and a wide covariance.
#[test]
fn thesis_estimate_before_one_wall_is_weak() {
    let wall = Scene::wall(Vector3::new(0.2, 0.1, 1.0), 2.5);
    let estimate = run(&wall, &pinhole(), &motion(), DT_S, ThesisConfig::default());
    let is_weak = matches!(
        estimate.status,
        TrackStatus::Weak(Reason::Unobservable { score }) if score < 0.01
    );
    assert!(is_weak, "{}", estimate.status);
    let unseen = estimate.weak_directions.iter().filter(|d| !d.estimated);
    assert_eq!(unseen.count(), 3);
    assert!(estimate.covariance.unwrap().diagonal().max() > 0.2);
}

/// What is not usable is a status with a reason, never an answer.
#[test]
fn thesis_estimate_of_bad_images_is_lost_with_a_reason() {
    let camera = pinhole();
    let mut estimator = ThesisEstimator::new(&camera, ThesisConfig::default()).unwrap();
    let (good, later) = images(&Scene::room(), &camera, &motion(), DT_S);
    let filled = |f: fn(usize, usize) -> f32| DepthMap::new(Plane::from_fn(320, 240, f));
    let unusable = [
        filled(|_, _| f32::NAN),
        filled(|_, _| f32::INFINITY),
        filled(|_, _| -1.0),
        filled(|_, _| 0.0),
    ];
    for bad in &unusable {
        let estimate = estimator.estimate(&good, bad, DT_S).unwrap();
        let few = matches!(
            estimate.status,
            TrackStatus::Lost(Reason::FewKnownPixels { .. })
        );
        assert!(few && estimate.twist.is_none(), "{}", estimate.status);
    }
    // One hole in every domain: nearly all pixels known, no domain is.
    let holes = filled(|x, y| {
        if x % 8 == 0 && y % 8 == 0 {
            f32::NAN
        } else {
            2.0
        }
    });
    let estimate = estimator.estimate(&good, &holes, DT_S).unwrap();
    let reason = estimate.status.reason();
    assert_eq!(
        reason,
        Some(Reason::FewDomains {
            found: 0,
            needed: 12
        })
    );
    assert!(estimate.twist.is_none() && estimate.known_share > 0.9);
    // Another place altogether.
    let elsewhere = filled(|x, y| 1.0 + ((x / 40 + y / 40) % 2) as f32);
    let estimate = estimator.estimate(&good, &elsewhere, DT_S).unwrap();
    assert_eq!(estimate.status.name(), "lost", "{}", estimate.status);
    // And the estimator is none the worse for it.
    let estimate = estimator.estimate(&good, &later, DT_S).unwrap();
    let (w, v) = errors(&estimate, &motion());
    assert!(w < 5.0 * EXACT && v < 5.0 * EXACT, "{w} {v}");
}

#[test]
fn thesis_estimate_of_wrong_arguments_names_them() {
    let camera = pinhole();
    let mut estimator = ThesisEstimator::new(&camera, ThesisConfig::default()).unwrap();
    let (a, b) = images(&Scene::room(), &camera, &motion(), DT_S);
    for dt_s in [0.0, -1.0, f64::NAN] {
        let error = estimator.estimate(&a, &b, dt_s).unwrap_err().to_string();
        assert!(error.starts_with("dt_s"), "{error}");
    }
    let small = DepthMap::new(Plane::filled(10, 10, 1.0));
    let error = estimator
        .estimate(&a, &small, DT_S)
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("depth1: expected shape 320x240"),
        "{error}"
    );
    let whole = Camera::equirectangular(64, 32).unwrap();
    let error = ThesisEstimator::new(&whole, ThesisConfig::default()).unwrap_err();
    assert!(error.to_string().contains("methods 'single'"), "{error}");
}

/// Thesis: section 6.4: the covariance is that of the result, where domains carry independent noise.
#[test]
fn thesis_covariance_agrees_with_the_errors_under_independent_noise() {
    use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
    use rand_distr::{Distribution, Normal};
    const PAIRS: u64 = 60;
    let camera = pinhole();
    let motion = motion();
    let (a, b) = images(&Scene::room(), &camera, &motion, DT_S);
    let noise = Normal::new(0.0, 1.5e-3).unwrap(); // of the inverse depth, 1/m
    for weights in [RowWeights::Equal, RowWeights::DomainNoise] {
        let config = ThesisConfig {
            weights,
            ..ThesisConfig::default()
        };
        let mut estimator = ThesisEstimator::new(&camera, config).unwrap();
        let (mut sum, mut square) = (0.0, 0.0);
        for seed in 0..PAIRS {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let mut noisy = |map: &DepthMap| {
                DepthMap::new(
                    map.metres()
                        .map(|z| (1.0 / (1.0 / f64::from(*z) + noise.sample(&mut random))) as f32),
                )
            };
            let (a, b) = (noisy(&a), noisy(&b));
            let estimate = estimator.estimate(&a, &b, DT_S).unwrap();
            let error: Vector6<f64> = estimate.twist.unwrap().vector() - motion.vector();
            let information = estimate.covariance.unwrap().try_inverse().unwrap();
            sum += error.dot(&(information * error));
            square += error.norm_squared();
        }
        let (mean, rms) = (sum / PAIRS as f64, (square / PAIRS as f64).sqrt());
        println!("{weights:?}: error squared over covariance {mean:.1} (6 is ideal), rms {rms:.4}");
        // The creases' own errors are not noise, neighbours share that of their common edge, and
        // noisy contours make least squares small (errors in variables).
        assert!((3.0..15.0).contains(&mean), "{mean}");
    }
}
