//! Holes, shadow, range and distortion of the Kinect noise, and what all depth noises promise.

use super::kinect_tests::{FOCAL_PX, HEIGHT, WIDTH, bare, camera, inverse_errors, noisy, plane};
use super::*;
use sphereflow_core::{DepthMap, Plane};
use sphereflow_sphere::camera::Camera;

fn bits(map: &DepthMap) -> Vec<u32> {
    map.metres().data().iter().map(|v| v.to_bits()).collect()
}

#[test]
fn kinect_holes_have_the_stated_share_in_blobs() {
    let truth = plane(0.4, 1.2);
    let parameters = KinectParameters {
        hole_share: 0.02,
        ..bare()
    };
    let frames = 20;
    let (mut lost, mut neighbours) = (0.0, 0.0);
    for frame in 0..frames {
        let read = noisy(parameters.clone(), &truth, frame);
        let data = read.metres().data();
        for (i, value) in data.iter().enumerate().skip(1) {
            if value.is_nan() {
                lost += 1.0;
                neighbours += f64::from(u8::from(data[i - 1].is_nan()));
            }
        }
    }
    let share = lost / (frames as f64 * (WIDTH * HEIGHT) as f64);
    // 125 blobs a frame, 2500 in all, of unequal size: three standard errors are 8 %.
    println!(
        "holes: {share:.4}, left neighbour lost too: {:.2}",
        neighbours / lost
    );
    assert!((share / 0.02 - 1.0).abs() < 0.08, "hole share {share}");
    assert!(neighbours / lost > 0.7, "holes are no blobs");
}

/// A wall at 3 m with a box at 1 m in front of its middle.
fn wall_and_box() -> DepthMap {
    DepthMap::new(Plane::from_fn(WIDTH, HEIGHT, |x, y| {
        if (250..390).contains(&x) && (180..300).contains(&y) {
            1.0
        } else {
            3.0
        }
    }))
}

#[test]
fn kinect_shadow_lies_beside_the_box_away_from_the_projector() {
    let truth = wall_and_box();
    let width_px = |right_m: f64| {
        let parameters = KinectParameters {
            sigma_inv_m: 0.0,
            projector_right_m: right_m,
            ..bare()
        };
        let read = noisy(parameters, &truth, 0);
        let row = read.metres().row(240);
        let lost = |from: usize, to: usize| row[from..to].iter().filter(|z| z.is_nan()).count();
        let above = read.metres().row(100).iter().filter(|z| z.is_nan()).count();
        (lost(0, 250), lost(250, 390), lost(390, WIDTH), above)
    };
    // f b (1/1 - 1/3) = 525 * 0.075 * 2/3 = 26.25 pixels; the discrete columns add up to 2.
    let expected = 26;
    let (left, on_box, right, above) = width_px(0.075);
    assert!(left.abs_diff(expected) <= 2, "{left} px of shadow");
    assert_eq!((on_box, right, above), (0, 0, 0));
    let (left, on_box, right, above) = width_px(-0.075);
    assert!(right.abs_diff(expected) <= 2, "{right} px of shadow");
    assert_eq!((left, on_box, above), (0, 0, 0));
    assert_eq!(width_px(0.0), (0, 0, 0, 0));
}

#[test]
fn kinect_shadow_does_not_fall_on_a_slanted_wall() {
    // 1/Z from 0.2 to 2 over the image: 71 degrees from frontal.
    for (from, to) in [(0.2, 2.0), (2.0, 0.2)] {
        let parameters = KinectParameters {
            projector_right_m: 0.075,
            ..bare()
        };
        let read = noisy(parameters, &plane(from, to), 0);
        assert_eq!(read.known_share(), 1.0, "1/Z from {from} to {to}");
    }
}

#[test]
fn kinect_range_limits_make_depth_outside_unknown() {
    let read = noisy(bare(), &plane(0.1, 4.0), 0);
    let known = read.metres().data().iter().filter(|z| z.is_finite());
    let (min, max) = known.fold((f32::MAX, 0.0_f32), |(a, b), z| (a.min(*z), b.max(*z)));
    assert!(
        (0.4..0.41).contains(&min) && (5.8..=6.0).contains(&max),
        "{min} to {max}"
    );
}

#[test]
fn kinect_distortion_is_tilt_and_quartic_of_inverse_depth() {
    let parameters = KinectParameters {
        sigma_inv_m: 0.0,
        quantum_inv_m: 0.0,
        distortion: Some(InverseDepthDistortion::default()),
        ..bare()
    };
    let truth = plane(0.5, 0.5);
    let read = noisy(parameters, &truth, 0);
    for (x, y) in [(0, 0), (639, 100), (320, 240), (50, 479)] {
        let (z1, z2) = ((x as f64 - 319.5) / FOCAL_PX, (y as f64 - 239.5) / FOCAL_PX);
        let expected = 1.0 - 0.02 * z1 - 0.05 * (z1 * z1 + z2 * z2).powi(2);
        let found = 2.0 / f64::from(read.metres()[(x, y)]);
        // A few roundings of f32.
        assert!(
            (found - expected).abs() < 1e-6,
            "({x}, {y}): {found}, {expected}"
        );
    }
}

#[test]
fn kinect_noise_is_the_same_with_one_and_two_threads_and_in_a_used_workspace() {
    let truth = wall_and_box();
    let noise = KinectNoise::new(KinectParameters::default(), 11).unwrap();
    let with_threads = |count| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(count)
            .build()
            .unwrap();
        pool.install(|| bits(&noise.apply(&truth, &camera(), 5).unwrap()))
    };
    let reference = with_threads(1);
    assert_eq!(reference, with_threads(2));
    let mut workspace = NoiseWorkspace::default();
    let small = Camera::pinhole(100.0, 100.0, 20.0, 15.0, 41, 31).unwrap();
    let mut other = DepthMap::new(Plane::filled(41, 31, 2.0));
    noise
        .apply_in_place(&mut other, &small, 9, &mut workspace)
        .unwrap();
    let mut depth = truth.clone();
    noise
        .apply_in_place(&mut depth, &camera(), 5, &mut workspace)
        .unwrap();
    assert_eq!(reference, bits(&depth));
}

#[test]
fn kinect_noise_of_other_seed_or_frame_has_nothing_in_common() {
    let truth = plane(0.4, 1.2);
    let read = |seed, frame| {
        let noise = KinectNoise::new(bare(), seed).unwrap();
        inverse_errors(&noise.apply(&truth, &camera(), frame).unwrap(), &truth)
    };
    let reference = read(1, 0);
    for other in [read(2, 0), read(1, 1)] {
        let products = reference.iter().zip(&other).map(|(a, b)| a * b);
        let covariance = products.sum::<f64>() / other.len() as f64;
        // About 5000 independent patches: three standard errors.
        assert!(
            (covariance / 1.8e-3_f64.powi(2)).abs() < 0.045,
            "{covariance}"
        );
    }
}

#[test]
fn depth_noise_leaves_unknown_depth_unknown() {
    let mut truth = plane(0.4, 1.2).into_plane();
    for i in (0..truth.data().len()).step_by(3) {
        truth.data_mut()[i] = f32::NAN;
    }
    let truth = DepthMap::new(truth);
    let kinect = KinectNoise::new(KinectParameters::default(), 1).unwrap();
    let independent = IndependentNoise::new(1.5e-3, 2.85e-3, 1).unwrap();
    for noise in [
        DepthNoise::None,
        DepthNoise::Independent(independent),
        DepthNoise::Kinect(kinect),
    ] {
        let read = noise.apply(&truth, &camera(), 0).unwrap();
        let pairs = read.metres().data().iter().zip(truth.metres().data());
        assert!(
            pairs.clone().all(|(r, t)| t.is_finite() || r.is_nan()),
            "{noise:?}"
        );
        assert!(read.known_share() > 0.6, "{noise:?}");
        if noise == DepthNoise::None {
            assert_eq!(bits(&read), bits(&truth));
        }
    }
}

#[test]
fn kinect_parameters_out_of_range_are_errors_that_name_them() {
    type Change = fn(&mut KinectParameters);
    let cases: [(&str, Change); 8] = [
        ("sigma_inv_m", |p| p.sigma_inv_m = -1e-3),
        ("sigma_inv_m", |p| p.sigma_inv_m = f64::NAN),
        ("quantum_inv_m", |p| p.quantum_inv_m = f64::INFINITY),
        ("hole_share", |p| p.hole_share = 1.0),
        ("min_range_m", |p| p.min_range_m = 0.0),
        ("max_range_m", |p| p.max_range_m = 0.3),
        ("correlation", |p| p.correlation.clear()),
        ("distortion.tilt", |p| {
            p.distortion = Some(InverseDepthDistortion {
                tilt: f64::NAN,
                quartic: 0.0,
            });
        }),
    ];
    for (name, change) in cases {
        let mut parameters = KinectParameters::default();
        change(&mut parameters);
        let error = KinectNoise::new(parameters, 0).unwrap_err().to_string();
        assert!(error.contains(name), "{name}: {error}");
    }
}

#[test]
fn kinect_noise_of_a_panorama_or_a_map_of_other_size_is_an_error_that_changes_nothing() {
    let noise = KinectNoise::new(KinectParameters::default(), 0).unwrap();
    let truth = plane(0.4, 1.2);
    let panorama = Camera::equirectangular(WIDTH, HEIGHT).unwrap();
    let small = Camera::pinhole(100.0, 100.0, 20.0, 15.0, 41, 31).unwrap();
    for (camera, name) in [(panorama, "camera"), (small, "depth")] {
        let mut depth = truth.clone();
        let mut workspace = NoiseWorkspace::default();
        let error = noise
            .apply_in_place(&mut depth, &camera, 0, &mut workspace)
            .unwrap_err();
        assert!(error.to_string().contains(name), "{error}");
        assert_eq!(bits(&depth), bits(&truth));
    }
}

#[test]
fn kinect_noise_in_place_reuses_the_image_and_the_workspace_from_the_second_frame_on() {
    let noise = KinectNoise::new(KinectParameters::default(), 0).unwrap();
    let (camera, mut depth) = (camera(), plane(0.4, 1.2));
    let mut workspace = NoiseWorkspace::default();
    let mut addresses = Vec::new();
    for frame in 0..3 {
        noise
            .apply_in_place(&mut depth, &camera, frame, &mut workspace)
            .unwrap();
        let image = depth.metres().data().as_ptr();
        addresses.push((image, workspace.addresses()));
    }
    assert_eq!(addresses[0], addresses[1]);
    assert_eq!(addresses[1], addresses[2]);
}

/// Prints the time of a whole frame; run with `--ignored --nocapture`.
#[test]
#[ignore = "prints a time, decides nothing"]
fn kinect_noise_of_a_frame_takes_how_long() {
    let noise = KinectNoise::new(KinectParameters::default(), 1).unwrap();
    let (camera, truth) = (camera(), wall_and_box());
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let mut workspace = NoiseWorkspace::default();
        let mut times: Vec<f64> = (0..60)
            .map(|frame| {
                let mut depth = truth.clone();
                let start = std::time::Instant::now();
                let result = pool
                    .install(|| noise.apply_in_place(&mut depth, &camera, frame, &mut workspace));
                result.unwrap();
                start.elapsed().as_secs_f64() * 1e3
            })
            .collect();
        times.sort_by(f64::total_cmp);
        println!(
            "{threads} threads: best {:.1} ms, median {:.1} ms",
            times[0], times[30]
        );
    }
}
