//! The depth filter on the room of section 4.1.1 and away from it, and on what it cannot see.

#![allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to

mod scene;

use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use scene::{Sequence, error_percent};
use sphereflow_core::Stamp;
use sphereflow_depth::{DepthFilter, DepthFilterConfig, VelocityNoise};
use sphereflow_sim::{Motion, Scene, SimConfig};
use sphereflow_sphere::Camera;

/// What is asked: two percent of salt and pepper leave a usable depth after less than a second.
const IMPULSES_PERCENT: f64 = 3.0;

/// Furnished, without noise: rims at edges and what has just come into view.
const FURNISHED_PERCENT: f64 = 1.5;

/// Light at a time (s) and a height in the image (0 to 1).
type Light = fn(f64, f64) -> f32;

/// What a run came to: errors E in percent, and the root mean square of error over deviation.
struct Run {
    half_second: f64,
    late_mean: f64,
    late_max: f64,
    normalised: f64,
}

/// 1.5 s of a sequence of 320x240; the error after half a second, and figures of the last half.
fn run(sequence: &Sequence, light: Light) -> Run {
    let config = DepthFilterConfig {
        binning: 1,
        ..DepthFilterConfig::default()
    };
    let mut filter = DepthFilter::new(sequence.camera(), config).unwrap();
    let (mut late, mut squares, mut pixels) = (Vec::new(), 0.0, 0.0);
    let mut half_second = f64::NAN;
    for index in 0..=90 {
        let mut frame = sequence.frame(index);
        let (width, height) = frame.image.size();
        for (y, row) in frame.image.data_mut().chunks_mut(width).enumerate() {
            let gain = light(frame.t_s, y as f64 / height as f64);
            row.iter_mut().for_each(|v| *v *= gain);
        }
        let stamp = Stamp::from_ns((frame.t_s * 1e9) as i64);
        filter.step(&frame.image, &frame.pose, stamp).unwrap();
        if index == 30 {
            half_second = error_percent(&filter.range().0, &frame.range, sequence.camera());
        }
        if index >= 60 && index % 6 == 0 {
            let (range, std) = filter.range();
            late.push(error_percent(&range, &frame.range, sequence.camera()));
            for ((d, s), t) in range.data().iter().zip(std.data()).zip(frame.range.data()) {
                squares += f64::from((d - t) / s).powi(2);
                pixels += 1.0;
            }
        }
    }
    Run {
        half_second,
        late_mean: late.iter().sum::<f64>() / late.len() as f64,
        late_max: late.iter().copied().fold(0.0, f64::max),
        normalised: (squares / pixels).sqrt(),
    }
}

fn steady(_: f64, _: f64) -> f32 {
    1.0
}

fn room(sigma: f64) -> Sequence {
    Sequence::room(320, 240, sigma)
}

#[test]
fn depth_filter_in_the_room_is_below_a_percent_under_noise_and_far_below_without() {
    // Thesis: section 4.1.1, whose observers reach 10 % at sigma 10. Half its size, noise of a pixel
    // as it is: measured 0.15 and 0.5 %.
    for (sigma, bound) in [(0.0, 0.3), (10.0, 1.0)] {
        let run = run(&room(sigma), steady);
        println!(
            "room, sigma {sigma}: mean {:.3} %, max {:.3} %, normalised {:.2}",
            run.late_mean, run.late_max, run.normalised
        );
        assert!(run.late_mean < bound && run.late_max < 2.0 * bound);
        assert!((0.3..3.0).contains(&run.normalised), "{}", run.normalised);
    }
}

#[test]
fn depth_filter_is_not_lost_in_a_furnished_room_without_noise() {
    let camera = SimConfig::thesis_camera(320, 240).unwrap();
    let sequence = Sequence::new(Scene::furnished_room(1), &camera, Motion::hand_held(7), 0.0);
    let run = run(&sequence, steady);
    println!(
        "furnished, no noise: {:.2} %, at most {:.2} %",
        run.late_mean, run.late_max
    );
    // Read without their own slopes and the variance of that, sharp edges are taken for depth.
    assert!(run.late_mean < FURNISHED_PERCENT, "{}", run.late_mean);
}

#[test]
fn depth_filter_does_not_take_rows_misplaced_by_its_own_start_for_light() {
    // As long as ranges are wrong, rows of paint look brighter or darker on these paths. Taken for light that left
    // 4 to 6 % for seconds, of which the filter was sure.
    let camera = SimConfig::thesis_camera(320, 240).unwrap();
    for motion in [9, 13, 32] {
        let path = Motion::hand_held(motion);
        let sequence = Sequence::new(Scene::thesis_room(), &camera, path, 10.0);
        let run = run(&sequence, steady);
        println!(
            "motion {motion}: {:.2} %, normalised {:.2}",
            run.late_mean, run.normalised
        );
        assert!(run.late_mean < 1.0, "{motion}: {}", run.late_mean);
        assert!(run.normalised < 3.0, "{motion}: {}", run.normalised);
    }
}

#[test]
fn depth_filter_starts_in_furnished_rooms_within_half_a_second() {
    // Thesis: section 4.1.1, its path, on which a faint wall beyond a corner comes into view at once; 1 % is asked.
    // Half its size, noise of a pixel as of 2x2 at ten: measured 0.77, 0.75, 0.95 %.
    let camera = SimConfig::thesis_camera(320, 240).unwrap();
    let mut sum = 0.0;
    for seed in 1..4 {
        let path = Motion::sinusoids_411();
        let sequence = Sequence::new(Scene::furnished_room(seed), &camera, path, 5.0);
        let run = run(&sequence, steady);
        println!(
            "furnished {seed}: {:.2} % after half a second",
            run.half_second
        );
        sum += run.half_second;
    }
    assert!(sum / 3.0 < 1.0, "{}", sum / 3.0);
}

#[test]
fn depth_filter_with_the_same_settings_works_elsewhere() {
    // Thesis: section 4.1.1, other surfaces, textures and paths.
    let camera = SimConfig::thesis_camera(320, 240).unwrap();
    let cases = [
        (
            "ellipsoid",
            Scene::thesis_ellipsoid(),
            Motion::sinusoids_411(),
            2.5,
        ),
        (
            "fine paint",
            Scene::thesis_room_with(0.15).unwrap(),
            Motion::sinusoids_411(),
            1.0,
        ),
        (
            "coarse paint",
            Scene::thesis_room_with(1.0).unwrap(),
            Motion::sinusoids_411(),
            2.0,
        ),
        ("hand-held", Scene::thesis_room(), Motion::hand_held(4), 1.0),
        (
            "furnished",
            Scene::furnished_room(3),
            Motion::hand_held(1),
            3.0,
        ),
    ];
    for (name, scene, motion, bound) in cases {
        let run = run(&Sequence::new(scene, &camera, motion, 5.0), steady);
        println!(
            "{name}: mean {:.3} %, max {:.3} %, normalised {:.2}",
            run.late_mean, run.late_max, run.normalised
        );
        assert!(run.late_mean < bound, "{name}: {}", run.late_mean);
    }
}

#[test]
fn depth_filter_takes_flicker_and_rolling_light_out() {
    // Thesis: section 4.2: aliased light at 4.17 Hz.
    const FLICKER: Light = |t, _| 1.0 + 0.1 * (std::f64::consts::TAU * 4.17 * t).sin() as f32;
    const ROLLING: Light =
        |t, y| 1.0 + 0.1 * (std::f64::consts::TAU * (4.17 * t + 0.8 * y)).sin() as f32;
    for (name, light) in [("flicker", FLICKER), ("rolling", ROLLING)] {
        let run = run(&room(5.0), light);
        println!(
            "{name}: mean {:.3} %, max {:.3} %",
            run.late_mean, run.late_max
        );
        assert!(run.late_mean < 1.5, "{name}: {}", run.late_mean);
    }
}

#[test]
fn depth_filter_runs_on_the_whole_sphere() {
    // Thesis: section 1.2: any central camera, all around.
    let camera = Camera::equirectangular(512, 256).unwrap();
    let scene = Scene::thesis_ellipsoid();
    let sequence = Sequence::new(scene, &camera, Motion::sinusoids_411(), 2.0);
    let config = DepthFilterConfig {
        binning: 1,
        ..DepthFilterConfig::default()
    };
    let mut filter = DepthFilter::new(&camera, config).unwrap();
    for index in 0..45 {
        let frame = sequence.frame(index);
        filter
            .step(&frame.image, &frame.pose, Stamp::from_ns(index as i64 + 1))
            .unwrap();
    }
    let error = error_percent(&filter.range().0, &sequence.frame(44).range, &camera);
    println!("whole sphere: {error:.2} %");
    assert!(error < 3.0, "{error}");
}

#[test]
fn depth_filter_survives_impulses_and_unknown_pixels() {
    let sequence = room(3.0);
    let config = DepthFilterConfig {
        binning: 1,
        ..DepthFilterConfig::default()
    };
    let mut filter = DepthFilter::new(sequence.camera(), config).unwrap();
    for index in 0..50 {
        let mut frame = sequence.frame(index);
        for (i, value) in frame.image.data_mut().iter_mut().enumerate() {
            // 2 % salt and pepper in a fixed pattern that moves, and a blind patch.
            let hash = (i * 7919 + index * 104_729) % 1009;
            *value = match hash {
                0..10 => 1.0,
                10..20 => 256.0,
                _ if i % 320 < 20 && i / 320 < 20 => f32::NAN,
                _ => *value,
            };
        }
        filter
            .step(&frame.image, &frame.pose, Stamp::from_ns(index as i64 + 1))
            .unwrap();
    }
    // Where nothing was ever known (and smoothing reaches from), nothing is asked.
    let mut truth = sequence.frame(49).range;
    for y in 0..40 {
        for x in 0..40 {
            truth[(x, y)] = f32::NAN;
        }
    }
    let error = error_percent(&filter.range().0, &truth, sequence.camera());
    println!("impulses: {error:.2} %");
    assert!(error < IMPULSES_PERCENT, "{error}");
}

#[test]
fn depth_filter_of_noisy_velocities_is_uncertain_but_near() {
    // Thesis: eq. (1.8). Exact velocities give what poses give; noisy ones a larger error.
    let sequence = room(3.0);
    let exact = VelocityNoise::default();
    let noisy = VelocityNoise {
        angular_rad_s: 0.005,
        linear_m_s: 0.05,
    };
    for (noise, bound) in [(exact, 1.0), (noisy, 12.0)] {
        let config = DepthFilterConfig {
            binning: 1,
            ..DepthFilterConfig::default()
        };
        let mut filter = DepthFilter::new(sequence.camera(), config).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut axes = |sigma: f64| {
            let normal = Normal::new(0.0, sigma).unwrap();
            Vector3::from_fn(|_, _| normal.sample(&mut rng))
        };
        for index in 0..46 {
            let mut twist = sequence.twist(index as f64 - 0.5);
            twist.linear_m_s += axes(noise.linear_m_s);
            twist.angular_rad_s += axes(noise.angular_rad_s);
            let image = sequence.frame(index).image;
            filter
                .step_with_velocity(&image, &twist, sequence.dt_s(), noise)
                .unwrap();
        }
        let error = error_percent(
            &filter.range().0,
            &sequence.frame(45).range,
            sequence.camera(),
        );
        println!("velocities with {} m/s: {error:.2} %", noise.linear_m_s);
        assert!(error < bound, "{error}");
    }
}
