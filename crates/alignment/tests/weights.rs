//! Settings that decide what is believed: the limit of what is estimated, and the noise model.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

mod scene;

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, Normal};
use scene::{DT_S, Scene, measure, pinhole, somewhere, twist, two_poses};
use sphereflow_alignment::{
    Also, Config, NoiseModel, VelocityEstimator, VelocityPrior, estimate_velocity,
};
use sphereflow_core::{DepthMap, Reason, TrackStatus, Twist};

fn motion() -> Twist {
    twist([0.3, -0.4, 0.2, 0.25, -0.1, 0.3])
}

/// A corridor with an end wall: its length is seen by that wall alone, and poorly.
fn corridor() -> Scene {
    Scene::Room(vec![
        (Vector3::x(), 1.2),
        (-Vector3::x(), 1.0),
        (Vector3::y(), 1.3),
        (-Vector3::y(), 1.2),
        (Vector3::z(), 9.0),
    ])
}

fn limited(max_std_m: f64) -> Config {
    Config {
        max_std_m,
        ..Config::default()
    }
}

#[test]
fn estimate_without_limit_takes_every_direction_of_a_closed_corridor() {
    let found = measure(&corridor(), &pinhole(), &motion(), &Config::default());
    println!("no limit: {}, {:?}", found.status, found.weak_directions);
    assert!(found.weak_directions.iter().all(|d| d.estimated));
}

/// Thesis: Theorem 3, with a limit of the user's.
#[test]
fn estimate_beyond_the_limit_is_held_at_the_prior_and_named() {
    let scene = corridor();
    let (a, b) = two_poses(&somewhere(), &motion(), DT_S);
    let images = [a, b].map(|pose| scene.depths(&pinhole(), &pose));
    let along = a.rotation.inverse() * Vector3::z(); // the corridor, in the camera
    // little information: the value where nothing else says more
    let known = VelocityPrior::none().and_linear(0.7 * along, 1e3);
    let also = Also {
        prior: Some(known),
        ..Also::default()
    };
    let mut held = 0;
    for max_std_m in [1e-2, 3e-3, 1e-3, 5e-4, 3e-4] {
        let mut estimator = VelocityEstimator::new(&pinhole(), limited(max_std_m)).unwrap();
        let found = estimator
            .estimate_with(&images[0], &images[1], DT_S, &also)
            .unwrap();
        let names: Vec<String> = found
            .weak_directions
            .iter()
            .map(|d| d.to_string())
            .collect();
        let now = found
            .weak_directions
            .iter()
            .filter(|d| !d.estimated)
            .count();
        println!("limit {max_std_m} m: {}, {names:?}", found.status);
        assert!(now >= held, "a stricter limit holds more");
        held = now;
        if now == 0 {
            continue;
        }
        assert_ne!(found.status, TrackStatus::Tracked);
        assert!(names.iter().filter(|n| n.contains("not estimated")).count() == now);
        if now == 1 {
            let weak = matches!(found.status, TrackStatus::Weak(Reason::Unobservable { .. }));
            assert!(weak, "{}", found.status);
            assert!(names[0].starts_with("translation along"), "{names:?}");
            let direction = found.weak_directions[0]
                .direction
                .fixed_rows::<3>(3)
                .into_owned();
            // a mixture with a little of the other directions
            assert!(direction.dot(&along).abs() > 0.98, "{direction}");
            let v = found.twist.unwrap().linear_m_s;
            // The prior's 0.7 m/s, and not the motion's; the rest is measured.
            assert!((v.dot(&along) - 0.7).abs() < 0.05, "{v}");
            let aside = |v: Vector3<f64>| v - along * v.dot(&along);
            assert!((aside(v) - aside(motion().linear_m_s)).norm() < 0.05, "{v}");
        }
    }
    assert!(held > 0, "no limit held anything");
}

#[test]
fn weak_directions_of_a_wall_have_names() {
    let scene = Scene::wall(somewhere().rotation * Vector3::z(), 2.5);
    let found = measure(&scene, &pinhole(), &motion(), &Config::default());
    let names: Vec<String> = found
        .weak_directions
        .iter()
        .map(|d| d.to_string())
        .collect();
    println!("{names:?}");
    assert_eq!(names.len(), 3, "{names:?}");
    assert!(
        names[..2]
            .iter()
            .all(|n| n.starts_with("translation along")),
        "{names:?}"
    );
    assert!(
        names[2].starts_with("rotation about (0.00, 0.00, 1.00)"),
        "{names:?}"
    );
    assert!(
        names.iter().all(|n| n.ends_with("m/s (not estimated)")),
        "{names:?}"
    );
}

/// Rms errors of omega and v with noise of the depth of `std_m` at all distances.
fn errors_with_depth_noise(std_m: f64, config: &Config) -> (f64, f64) {
    const SEEDS: u64 = 30;
    // walls from 0.5 m, where the inverse depth is good to nothing, to 9 m
    let scene = Scene::Room(vec![
        (Vector3::new(1.0, 0.1, 0.1).normalize(), 0.9),
        (Vector3::new(-1.0, 0.2, 0.1).normalize(), 1.2),
        (Vector3::new(0.1, 1.0, 0.1).normalize(), 1.0),
        (Vector3::new(0.0, -1.0, 0.2).normalize(), 2.2),
        (Vector3::new(0.2, 0.1, 1.0).normalize(), 6.0),
        (Vector3::new(-0.5, -0.2, 1.0).normalize(), 6.5),
    ]);
    let (a, b) = two_poses(&somewhere(), &motion(), DT_S);
    let exact = [a, b].map(|pose| scene.depths(&pinhole(), &pose));
    let normal = Normal::new(0.0, std_m).unwrap();
    let (mut w, mut v) = (0.0, 0.0);
    for seed in 0..SEEDS {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let noisy = [0, 1].map(|i: usize| {
            let metres = exact[i].metres();
            DepthMap::new(metres.map(|z| z + normal.sample(&mut random) as f32))
        });
        let found = estimate_velocity(&pinhole(), &noisy[0], &noisy[1], DT_S, config).unwrap();
        let error = found.twist.unwrap().vector() - motion().vector();
        w += error.fixed_rows::<3>(0).norm_squared();
        v += error.fixed_rows::<3>(3).norm_squared();
    }
    ((w / SEEDS as f64).sqrt(), (v / SEEDS as f64).sqrt())
}

#[test]
fn noise_model_of_time_of_flight_is_better_where_the_depth_errs_alike_at_all_distances() {
    let disparity = errors_with_depth_noise(0.01, &Config::default());
    let config = Config {
        noise: NoiseModel::time_of_flight(),
        ..Config::default()
    };
    let flight = errors_with_depth_noise(0.01, &config);
    println!(
        "1 cm of depth noise, rms rad/s and m/s: disparity {disparity:.4?}, time of flight {flight:.4?}"
    );
    assert!(flight.0 < 0.8 * disparity.0 && flight.1 < 0.9 * disparity.1);
}

#[test]
fn noise_model_changes_nothing_on_exact_depth() {
    let config = Config {
        noise: NoiseModel::time_of_flight(),
        ..Config::default()
    };
    let found = measure(&Scene::room(), &pinhole(), &motion(), &config);
    assert_eq!(found.status, TrackStatus::Tracked);
    assert!((found.twist.unwrap().vector() - motion().vector()).norm() < 1e-3);
}
