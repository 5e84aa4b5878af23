//! The IMU: signs, frames, units and statistics.

use super::*;
use nalgebra::{UnitQuaternion, Vector3};
use sphereflow_core::{Pose, Stamp};
use std::f64::consts::FRAC_PI_2;

/// Rounding of a handful of f64 operations on numbers near 10.
const ROUNDING: f64 = 1e-13;

fn rest() -> BodyMotion {
    BodyMotion::at_rest(UnitQuaternion::identity())
}

fn perfect() -> Imu {
    Imu::new(ImuParameters::default(), 0).unwrap()
}

/// `count` readings at rest at the parameters' rate.
fn readings(parameters: ImuParameters, seed: u64, count: usize) -> Vec<ImuReading> {
    let mut imu = Imu::new(parameters, seed).unwrap();
    let period = imu.period_s();
    (0..count)
        .map(|k| {
            imu.sample(Stamp::default().plus_seconds(k as f64 * period), &rest())
                .unwrap()
        })
        .collect()
}

fn sigma(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn imu_at_rest_reads_minus_gravity_on_the_y_axis_and_no_rotation() {
    let sample = perfect().ideal(Stamp::default(), &rest());
    assert_eq!(sample.accel_m_s2, Vector3::new(0.0, -9.81, 0.0));
    assert_eq!(sample.gyro_rad_s, Vector3::zeros());
    // Camera lying on its back, looking up (z of the camera is -y of the world): up is +z.
    let looking_up = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), FRAC_PI_2);
    assert!((looking_up * Vector3::z() - Vector3::new(0.0, -1.0, 0.0)).norm() < ROUNDING);
    let sample = perfect().ideal(Stamp::default(), &BodyMotion::at_rest(looking_up));
    assert!((sample.accel_m_s2 - Vector3::new(0.0, 0.0, 9.81)).norm() < ROUNDING);
}

#[test]
fn imu_pushed_forward_reads_the_acceleration_and_in_free_fall_nothing() {
    let mut motion = rest();
    motion.accel_world = Vector3::new(0.0, 0.0, 2.0);
    let sample = perfect().ideal(Stamp::default(), &motion);
    assert_eq!(sample.accel_m_s2, Vector3::new(0.0, -9.81, 2.0));
    motion.accel_world = GRAVITY_M_S2;
    let sample = perfect().ideal(Stamp::default(), &motion);
    assert_eq!(sample.accel_m_s2, Vector3::zeros());
}

/// A camera that turns and shakes: pose at `t`, smooth.
fn pose_at(t: f64) -> Pose {
    let rotation = UnitQuaternion::from_euler_angles(
        0.4 * (1.3 * t).sin(),
        0.7 * (0.9 * t + 0.4).sin(),
        0.3 * (2.1 * t).cos(),
    );
    let position = Vector3::new((2.0 * t).sin(), 0.3 * (3.0 * t).cos(), 0.5 * t * t);
    Pose::new(rotation, position)
}

fn omega_at(t: f64, camera_from_body: &UnitQuaternion<f64>) -> Vector3<f64> {
    let h = 1e-4;
    let attitude = |t: f64| pose_at(t).rotation * camera_from_body;
    (attitude(t - h).inverse() * attitude(t + h)).scaled_axis() / (2.0 * h)
}

#[test]
fn imu_on_a_lever_arm_reads_the_second_difference_of_its_own_path() {
    // Second differences of step 1e-3 of a path with derivatives near 30: error near 1e-5.
    let (tolerance, h) = (1e-4, 1e-3);
    let camera_from_imu = Pose::new(
        UnitQuaternion::from_euler_angles(0.5, -1.0, 2.0),
        Vector3::new(0.1, -0.2, 0.05),
    );
    let imu = Imu::new(
        ImuParameters {
            camera_from_imu,
            ..ImuParameters::default()
        },
        0,
    )
    .unwrap();
    let second =
        |f: &dyn Fn(f64) -> Vector3<f64>, t: f64| (f(t + h) - 2.0 * f(t) + f(t - h)) / (h * h);
    for t in [0.0, 0.7, 1.9] {
        let none = UnitQuaternion::identity();
        let motion = BodyMotion {
            world_from_camera: pose_at(t).rotation,
            omega_body: omega_at(t, &none),
            alpha_body: (omega_at(t + h, &none) - omega_at(t - h, &none)) / (2.0 * h),
            accel_world: second(&|t| pose_at(t).translation, t),
        };
        let sample = imu.ideal(Stamp::default(), &motion);
        let world_from_imu = pose_at(t) * camera_from_imu;
        let path = second(&|t| (pose_at(t) * camera_from_imu).translation, t);
        let force = world_from_imu.rotation.inverse() * (path - GRAVITY_M_S2);
        assert!(
            (sample.accel_m_s2 - force).norm() < tolerance,
            "{t} s: {sample:?}, {force}"
        );
        let omega = omega_at(t, &camera_from_imu.rotation);
        assert!(
            (sample.gyro_rad_s - omega).norm() < tolerance,
            "{t} s: {sample:?}, {omega}"
        );
    }
}

#[test]
fn imu_noise_density_is_the_deviation_of_means_times_the_root_of_their_time() {
    let (gyro_density, accel_density) = (2e-3, 3e-2);
    let parameters = ImuParameters {
        gyroscope_noise_density: gyro_density,
        accelerometer_noise_density: accel_density,
        ..ImuParameters::default()
    };
    let all = readings(parameters, 3, 200_000);
    // 200 000 readings at 200 Hz are 1000 s: 3000 means of 1 s (three axes), 750 of 4 s. Four
    // standard errors of the fewest.
    let tolerance = 4.0 / 1500.0_f64.sqrt();
    for seconds in [0.005, 1.0, 4.0] {
        let block = (seconds * 200.0) as usize;
        let (mut gyro, mut accel) = (Vec::new(), Vec::new());
        for chunk in all.chunks_exact(block) {
            let mean = |f: &dyn Fn(&ImuReading) -> Vector3<f64>| {
                chunk.iter().map(f).sum::<Vector3<f64>>() / block as f64
            };
            gyro.extend(mean(&|r| r.sample.gyro_rad_s).iter());
            accel.extend(mean(&|r| r.sample.accel_m_s2 + GRAVITY_M_S2).iter());
        }
        for (values, density) in [(gyro, gyro_density), (accel, accel_density)] {
            let found = sigma(&values) * f64::sqrt(seconds);
            assert!(
                (found / density - 1.0).abs() < tolerance,
                "{seconds} s: {found}, {density}"
            );
        }
    }
}

#[test]
fn imu_bias_walks_with_the_root_of_time_from_its_initial_value() {
    let (gyro_walk, accel_walk) = (1e-4, 2e-3);
    let initial_bias = ImuBias {
        gyro_rad_s: Vector3::new(0.01, -0.008, 0.012),
        accel_m_s2: Vector3::new(0.072, -0.023, -0.12),
    };
    let parameters = ImuParameters {
        gyroscope_random_walk: gyro_walk,
        accelerometer_random_walk: accel_walk,
        initial_bias,
        ..ImuParameters::default()
    };
    // 300 seeds, 3 axes: four standard errors of a deviation.
    let tolerance = 4.0 / 1800.0_f64.sqrt();
    let runs: Vec<_> = (0..300)
        .map(|seed| readings(parameters, seed, 2001))
        .collect();
    assert!(runs.iter().all(|run| run[0].bias == initial_bias));
    for (k, seconds) in [(200, 1.0), (800, 4.0), (2000, 10.0)] {
        let (mut gyro, mut accel) = (Vec::new(), Vec::new());
        for run in &runs {
            gyro.extend((run[k].bias.gyro_rad_s - initial_bias.gyro_rad_s).iter());
            accel.extend((run[k].bias.accel_m_s2 - initial_bias.accel_m_s2).iter());
            let read = run[k].sample.gyro_rad_s - run[k].bias.gyro_rad_s;
            assert!(
                read.norm() < ROUNDING,
                "the reported bias is not the one in the reading"
            );
        }
        for (values, walk) in [(gyro, gyro_walk), (accel, accel_walk)] {
            let found = sigma(&values) / f64::sqrt(seconds);
            assert!(
                (found / walk - 1.0).abs() < tolerance,
                "{seconds} s: {found}, {walk}"
            );
        }
    }
}

#[test]
fn imu_of_one_seed_repeats_itself_and_of_another_differs() {
    let parameters = ImuParameters {
        gyroscope_noise_density: 1e-3,
        ..ImuParameters::default()
    };
    assert_eq!(readings(parameters, 1, 20), readings(parameters, 1, 20));
    assert_ne!(readings(parameters, 1, 20), readings(parameters, 2, 20));
}

#[test]
fn imu_parameters_stamps_and_motions_that_are_wrong_are_errors_that_name_them() {
    let default = ImuParameters::default();
    let cases = [
        (
            "rate_hz",
            ImuParameters {
                rate_hz: 0.0,
                ..default
            },
        ),
        (
            "gyroscope_noise_density",
            ImuParameters {
                gyroscope_noise_density: -1.0,
                ..default
            },
        ),
        (
            "accelerometer_random_walk",
            ImuParameters {
                accelerometer_random_walk: f64::NAN,
                ..default
            },
        ),
        (
            "gravity_m_s2",
            ImuParameters {
                gravity_m_s2: Vector3::repeat(f64::NAN),
                ..default
            },
        ),
    ];
    for (name, parameters) in cases {
        let error = Imu::new(parameters, 0).unwrap_err().to_string();
        assert!(error.contains(name), "{name}: {error}");
    }
    let mut imu = perfect();
    imu.sample(Stamp::from_ns(5), &rest()).unwrap();
    let error = imu
        .sample(Stamp::from_ns(5), &rest())
        .unwrap_err()
        .to_string();
    assert!(error.contains("stamp"), "{error}");
    let mut motion = rest();
    motion.accel_world.x = f64::NAN;
    let error = imu
        .sample(Stamp::from_ns(6), &motion)
        .unwrap_err()
        .to_string();
    assert!(error.contains("motion"), "{error}");
    assert!(
        imu.sample(Stamp::from_ns(6), &rest()).is_ok(),
        "a failed call moved the clock"
    );
}
