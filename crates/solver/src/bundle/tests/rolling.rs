//! A rolling-shutter depth camera in a box: times, depth field and lens found with the poses.

use crate::bundle::{
    BundleAdjuster, BundleProblem, DeviceCalibration, ReadDepth, RowMotion, adjust,
};
use crate::generate::Random;
use crate::{LinearSolver, Loss, Options};
use nalgebra::{DVector, Matrix2, UnitQuaternion, Vector2, Vector3, Vector6};
use sphereflow_core::Pose;
use sphereflow_sphere::Camera;
use sphereflow_sphere::depth_correction::correction_terms;
use sphereflow_sphere::lie::se3;

const POSES: usize = 16;
const EVERY_S: f64 = 0.25;
const ROOM: [f64; 3] = [3.0, 1.4, 3.0];
const PIXEL: f64 = 0.5;
const INV_DEPTH: f64 = 6e-3;
/// Depth is stamped so long after colour.
const DEPTH_AFTER_S: f64 = 0.005;
const TRUE: DeviceCalibration = DeviceCalibration {
    readout_s: 0.025,
    colour_offset_s: 0.019,
    depth_field: [-0.024, 0.01, 0.008, -0.006, 0.004, 0.01, -0.01, -0.1],
};
const NAMES: [&str; 10] = crate::bundle::device::NAMES;

fn tight() -> Options {
    Options {
        max_iterations: 60,
        function_tolerance: 1e-10,
        ..Options::default()
    }
}

fn camera(k1: f64) -> Camera {
    let lens = [k1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    Camera::opencv(420.0, 420.0, 319.5, 239.5, lens, 640, 480).unwrap()
}

/// Where the camera is; it turns by up to 1.8 rad/s and drives by up to 0.8 m/s.
fn pose(t: f64) -> Pose {
    let yaw = 0.9 * t + 0.4 * (2.1 * t).sin();
    let turn = UnitQuaternion::new(Vector3::y() * yaw)
        * UnitQuaternion::new(Vector3::x() * (0.3 * (1.3 * t).sin()))
        * UnitQuaternion::new(Vector3::z() * (0.2 * (1.9 * t).sin()));
    let (sine, cosine) = (0.9 * t).sin_cos();
    Pose::new(
        turn,
        Vector3::new(0.8 * sine, 0.2 * (1.7 * t).sin(), 0.8 * cosine),
    )
}

fn twist(t: f64) -> Vector6<f64> {
    let h = 1e-4;
    se3::log(&(pose(t - h).inverse() * pose(t + h))) / (2.0 * h)
}

fn row_motion(t: f64) -> RowMotion {
    let h = 1e-3;
    let (here, rate) = (twist(t), (twist(t + h) - twist(t - h)) / (2.0 * h));
    RowMotion {
        omega: here.fixed_rows::<3>(0).into_owned(),
        velocity: here.fixed_rows::<3>(3).into_owned(),
        omega_rate: rate.fixed_rows::<3>(0).into_owned(),
        velocity_rate: rate.fixed_rows::<3>(3).into_owned(),
    }
}

fn row_time(pixel: &Vector2<f64>, readout_s: f64) -> f64 {
    ((pixel.y + 0.5) / 480.0 - 0.5) * readout_s
}

/// The pixel of a point in the image whose middle is at `t`.
fn project(camera: &Camera, at: &Vector3<f64>, t: f64) -> Option<Vector2<f64>> {
    let mut pixel = Vector2::new(319.5, 239.5);
    for _ in 0..12 {
        let seen = pose(t + row_time(&pixel, TRUE.readout_s))
            .inverse()
            .transform(at);
        pixel = (seen.z > 0.3).then(|| camera.project(&seen)).flatten()?;
    }
    camera.contains(&pixel).then_some(pixel)
}

fn factor(camera: &Camera, pixel: &Vector2<f64>) -> f64 {
    let ray = camera.unproject(pixel).unwrap();
    let [_, terms @ ..] = correction_terms(ray.x / ray.z, ray.y / ray.z);
    1.0 + TRUE
        .depth_field
        .iter()
        .zip(terms)
        .map(|(c, t)| c * t)
        .sum::<f64>()
}

/// What the depth image whose middle is at `t` holds at a pixel: 1/Z of the wall, distorted.
fn depth_image(camera: &Camera, pixel: &Vector2<f64>, t: f64) -> f64 {
    let from = pose(t + row_time(pixel, TRUE.readout_s));
    let ray = camera.unproject(pixel).unwrap();
    let (ray, centre) = (from.rotation * (ray / ray.z), from.translation);
    let walls = (0..3).map(|axis| ray[axis] / (ROOM[axis] * ray[axis].signum() - centre[axis]));
    // the nearest wall ahead has the largest inverse depth
    walls.fold(0.0, f64::max) / factor(camera, pixel)
}

/// 1/Z at a pixel of the colour image, read from the depth image where its point was, with an
/// assumed device; `t` is the true middle of the colour exposure.
fn read(
    camera: &Camera,
    pixel: &Vector2<f64>,
    (t, rows): (f64, &RowMotion),
    assumed: &DeviceCalibration,
    noise: f64,
) -> Option<(f64, [f64; 2])> {
    let row = row_time(pixel, assumed.readout_s);
    let after = DEPTH_AFTER_S - assumed.colour_offset_s;
    let middle = t - TRUE.colour_offset_s + DEPTH_AFTER_S;
    let (mut q, mut place) = (0.5, [0.0; 2]);
    for _ in 0..4 {
        let ray = camera.unproject(pixel)?;
        let y = rows.in_pose(&(ray / (ray.z * q)), row)?;
        let mut there = *pixel;
        for _ in 0..4 {
            let later = after + row_time(&there, assumed.readout_s);
            there = camera.project(&rows.seen_at(&y, later))?;
        }
        if !camera.contains(&there) {
            return None;
        }
        let ray = camera.unproject(&there)?;
        let inv_depth = depth_image(camera, &there, middle) + noise;
        let x = ray / (ray.z * inv_depth);
        let y = rows.in_pose(&x, after + row_time(&there, assumed.readout_s))?;
        q = 1.0 / rows.seen_at(&y, row).z;
        place = [ray.x / ray.z, ray.y / ray.z];
    }
    Some((q, place))
}

/// The box with `points` on its walls, seen by a camera whose lens is `lens`; read, linearised and
/// begun with an assumed device.
fn world(seed: u64, points: usize, lens: &Camera, assumed: &DeviceCalibration) -> BundleProblem {
    let start = camera(0.0);
    let (mut random, mut noise) = (Random::new(7), Random::new(seed));
    let mut problem = BundleProblem::new();
    problem.add_camera(start.clone());
    problem.set_device(0, assumed).unwrap();
    for k in 0..POSES {
        let t = EVERY_S * k as f64;
        let off = if k > 0 {
            noise.normal::<6>(0.003)
        } else {
            Vector6::zeros()
        };
        problem.add_pose(pose(t) * se3::exp(&off), 0).unwrap();
        problem.set_row_motion(k, row_motion(t)).unwrap();
    }
    problem.fix_pose(0).unwrap();
    for _ in 0..points {
        let mut at = Vector3::from_fn(|axis, _| random.between(-ROOM[axis], ROOM[axis]));
        let axis = random.below(3);
        at[axis] = ROOM[axis] * at[axis].signum();
        let point = problem.add_point(at + noise.normal::<3>(0.01)).unwrap();
        for k in 0..POSES {
            let t = EVERY_S * k as f64;
            let Some(pixel) = project(lens, &at, t) else {
                continue;
            };
            let off = noise.normal::<1>(INV_DEPTH).x;
            let depth = |offset: f64| {
                let assumed = DeviceCalibration {
                    colour_offset_s: assumed.colour_offset_s + offset,
                    ..*assumed
                };
                read(lens, &pixel, (t, &row_motion(t)), &assumed, off)
            };
            let read = || {
                let ((inv_depth, place), step) = (depth(0.0)?, 1e-4);
                let change = depth(step)?.0 - depth(-step)?.0;
                Some(ReadDepth {
                    inv_depth,
                    sigma: INV_DEPTH,
                    colour_offset_s: assumed.colour_offset_s,
                    by_offset: change / (2.0 * step),
                    place,
                })
            };
            let depth = read();
            let pixel = pixel + noise.normal::<2>(PIXEL);
            let spread = Matrix2::identity() * (PIXEL * PIXEL);
            problem
                .add_sighting(k, point, pixel, &spread, depth)
                .unwrap();
        }
    }
    problem
}

fn numbers(device: &DeviceCalibration) -> DVector<f64> {
    let times = [device.readout_s, device.colour_offset_s];
    DVector::from_iterator(10, times.into_iter().chain(device.depth_field))
}

/// Standard deviations off, at most, of fifteen numbers: 3.5 of one in 2000 each.
const SIGMAS: f64 = 3.5;
/// Of the prior deviations, what is left at most of those of both times and the field's tilt: the
/// measurements tell them, not the priors.
const LEFT: f64 = 0.25;

#[test]
fn device_and_lens_are_found_within_their_deviations_from_nothing() {
    let lens = camera(0.02);
    let mut assumed = DeviceCalibration::default();
    let mut names = NAMES.to_vec();
    names.extend(["fx", "fy", "cx", "cy", "k1"]);
    // what was read is transported with the device that the last round found
    for round in 0..2 {
        let mut problem = world(11, 300, &lens, &assumed);
        problem.losses.pixel = Loss::Cauchy(2.0);
        problem.losses.inverse_depth = Loss::Cauchy(2.0);
        problem.free_intrinsics(0, &names).unwrap();
        for (name, value, sigma) in [("fx", 420.0, 8.4), ("fy", 420.0, 8.4), ("cx", 319.5, 8.4)] {
            problem.add_camera_prior(0, name, value, sigma).unwrap();
        }
        for (name, value, sigma) in [("cy", 239.5, 8.4), ("k1", 0.0, 0.05)] {
            problem.add_camera_prior(0, name, value, sigma).unwrap();
        }
        for (k, name) in NAMES.iter().enumerate() {
            let sigma = if k < 2 { 0.02 } else { 0.05 };
            problem.add_camera_prior(0, name, 0.0, sigma).unwrap();
        }
        let mut adjuster = BundleAdjuster::new(problem, LinearSolver::Auto);
        let summary = adjuster.solve(&tight()).unwrap();
        println!("{:?} {} steps", summary.stop, summary.iterations.len());
        let covariance = adjuster.camera_covariance(0).unwrap();
        let found = adjuster.problem();
        assumed = found.device(0).unwrap();
        let lens = found.camera(0).unwrap().named_parameters();
        let mut gaps: Vec<f64> = (numbers(&assumed) - numbers(&TRUE))
            .iter()
            .copied()
            .collect();
        let truth = [420.0, 420.0, 319.5, 239.5, 0.02];
        gaps.extend(
            truth
                .iter()
                .zip(&lens)
                .map(|(truth, (_, value))| value - truth),
        );
        for (k, gap) in gaps.iter().enumerate() {
            let sigma = covariance[(k, k)].sqrt();
            println!("{round} {}: off by {gap:.2e}, sigma {sigma:.2e}", names[k]);
            assert!(round == 0 || gap.abs() < SIGMAS * sigma, "{}", names[k]);
        }
        for (k, prior) in [0.02, 0.02, 0.05].into_iter().enumerate() {
            assert!(covariance[(k, k)].sqrt() < LEFT * prior, "{}", names[k]);
        }
    }
}

const RUNS: u64 = 40;
/// The mean of 40 squared errors of ten numbers, variance 20 each, is good to 0.71; four of those.
const MONTE_CARLO: f64 = 2.9;

#[test]
fn covariance_of_the_device_equals_monte_carlo() {
    let mut sum = 0.0;
    for run in 0..RUNS {
        let mut problem = world(100 + run, 120, &camera(0.0), &TRUE);
        problem.free_intrinsics(0, &NAMES).unwrap();
        let mut adjuster = BundleAdjuster::new(problem, LinearSolver::Auto);
        adjuster.solve(&tight()).unwrap();
        let found = adjuster.problem().device(0).unwrap();
        let gap = numbers(&found) - numbers(&TRUE);
        let covariance = adjuster.camera_covariance(0).unwrap();
        sum += covariance.cholesky().unwrap().solve(&gap).dot(&gap);
    }
    let mean = sum / RUNS as f64;
    println!("squared error in its own metric: {mean:.2} of 10");
    assert!((mean - 10.0).abs() < MONTE_CARLO, "{mean}");
}

/// A squared error of 36 numbers in its own metric: 36, and four times its deviation of 8.5.
const LOCAL: f64 = 70.0;

#[test]
fn local_bundle_of_a_known_device_is_as_good_as_it_says_and_needs_row_times() {
    let moving: Vec<usize> = (POSES - 6..POSES).collect();
    let error = |readout_s: f64| {
        let mut problem = world(21, 200, &camera(0.0), &TRUE);
        for k in 0..POSES - 6 {
            problem.set_pose(k, pose(EVERY_S * k as f64)).unwrap();
            problem.fix_pose(k).unwrap();
        }
        let device = DeviceCalibration { readout_s, ..TRUE };
        problem.set_device(0, &device).unwrap();
        let mut adjuster = BundleAdjuster::new(problem, LinearSolver::Auto);
        let summary = adjuster.solve(&tight()).unwrap();
        assert!(summary.stop.converged(), "{:?}", summary.stop);
        let covariance = adjuster.covariance(&moving).unwrap();
        let gaps = moving.iter().flat_map(|&k| {
            let found = adjuster.problem().pose(k).unwrap();
            let gap = se3::log(&(found.inverse() * pose(EVERY_S * k as f64)));
            gap.iter().copied().collect::<Vec<f64>>()
        });
        let gap = DVector::from_iterator(36, gaps);
        covariance.cholesky().unwrap().solve(&gap).dot(&gap)
    };
    let (rolling, still) = (error(TRUE.readout_s), error(0.0));
    println!("{rolling:.1} of 36, without row times {still:.0}");
    assert!(rolling < LOCAL && still > 10.0 * LOCAL);
}

#[test]
fn device_and_poses_do_not_depend_on_the_number_of_threads() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let mut problem = world(31, 250, &camera(0.0), &DeviceCalibration::default());
        problem.free_intrinsics(0, &NAMES).unwrap();
        problem.losses.pixel = Loss::Cauchy(2.0);
        let (a, b) = (problem.pose(3).unwrap(), problem.pose(4).unwrap());
        let information = nalgebra::Matrix6::identity() * 1e4;
        (problem.add_relative_pose((3, 4), &(a.inverse() * b), &information, Loss::Cauchy(2.5)))
            .unwrap();
        let options = Options {
            max_iterations: 5,
            ..tight()
        };
        pool.install(|| adjust(&mut problem, LinearSolver::Auto, &options).unwrap());
        problem
    };
    let (one, two) = (run(1), run(2));
    assert_eq!(one.device(0), two.device(0));
    assert!((0..POSES).all(|k| one.pose(k) == two.pose(k)));
    assert!((0..250).all(|k| one.point(k) == two.point(k)));
}
