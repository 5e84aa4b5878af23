//! Round trips of the calibrations, and what they say of recordings that do not excite them.

use crate::{camera_imu, imu_still, mag_ellipsoid};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use sphereflow_core::Stamp;
use sphereflow_observers::{Reason, Status};

fn noise() -> impl FnMut(f64) -> Vector3<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    move |sigma| {
        Vector3::from_fn(|_, _| sigma * Distribution::<f64>::sample(&StandardNormal, &mut rng))
    }
}

fn stamps(count: usize, hz: f64) -> Vec<Stamp> {
    (0..count)
        .map(|i| Stamp::from_ns((i as f64 / hz * 1e9).round() as i64))
        .collect()
}

#[test]
fn imu_at_rest_gives_its_bias_and_noise_density() {
    let (mut noise, stamps) = (noise(), stamps(4000, 200.0));
    let bias = Vector3::new(0.01, -0.02, 0.005);
    let gyro: Vec<_> = stamps.iter().map(|_| bias + noise(2.5e-3)).collect();
    let accel: Vec<_> = stamps
        .iter()
        .map(|_| Vector3::new(0.0, -9.9, 0.0) + noise(0.03))
        .collect();
    let found = imu_still(&gyro, &accel, &stamps, 9.81).unwrap();
    assert_eq!(found.status, Status::Ok);
    assert!((found.gyro_bias_rad_s - bias).norm() < 2e-4);
    assert!((found.accel_bias_along_up_m_s2 - 0.09).abs() < 2e-3);
    let density = 2.5e-3 / 200.0_f64.sqrt();
    assert!((found.gyro_noise_density.x / density - 1.0).abs() < 0.05);
    let moving: Vec<_> = gyro
        .iter()
        .enumerate()
        .map(|(i, g)| g + Vector3::z() * (i as f64 * 0.002).sin())
        .collect();
    let moved = imu_still(&moving, &accel, &stamps, 9.81).unwrap();
    assert_eq!(moved.status, Status::Weak(Reason::NotStill));
    let short = imu_still(&gyro[..400], &accel[..400], &stamps[..400], 9.81).unwrap();
    assert!(matches!(
        short.status,
        Status::Weak(Reason::Settling { .. })
    ));
    assert!(imu_still(&gyro[1..], &accel, &stamps, 9.81).is_err());
}

#[test]
fn iron_of_a_magnetometer_is_found_again() {
    let (mut noise, mut directions) = (noise(), noise());
    let soft = Matrix3::new(1.1, 0.05, 0.0, 0.05, 0.9, 0.03, 0.0, 0.03, 1.05);
    let hard = Vector3::new(12.0, -30.0, 8.0);
    let all: Vec<Vector3<f64>> = (0..2000)
        .map(|_| directions(1.0).normalize() * 48.0)
        .collect();
    let readings: Vec<_> = all.iter().map(|b| soft * b + hard + noise(0.3)).collect();
    let found = mag_ellipsoid(&readings).unwrap();
    assert_eq!(found.status, Status::Ok);
    assert!(
        (found.hard_iron_ut - hard).norm() < 0.1,
        "{:?}",
        found.hard_iron_ut
    );
    assert!(found.residual_ut < 0.5);
    let round = found.correction * soft;
    let scale = round.trace() / 3.0;
    assert!(
        (round - Matrix3::identity() * scale).norm() < 0.01 * scale,
        "{round}"
    );
    let flat: Vec<_> = all
        .iter()
        .map(|b| Vector3::new(b.x, b.y, 0.0) + noise(1e-9))
        .collect();
    assert!(mag_ellipsoid(&flat).is_err());
    let cap: Vec<_> = readings
        .iter()
        .zip(&all)
        .filter(|(_, b)| b.z > 40.0)
        .map(|(r, _)| *r)
        .collect();
    assert!(mag_ellipsoid(&cap).map_or(true, |f| f.status != Status::Ok));
}

#[test]
fn rotation_and_time_offset_of_camera_and_gyro_are_found_again() {
    let mut noise = noise();
    let rotation = UnitQuaternion::from_euler_angles(0.3, -1.2, 2.0);
    let (offset, bias) = (0.0234, Vector3::new(0.02, -0.01, 0.03));
    let rate = |t: f64| {
        Vector3::new(
            (2.1 * t).sin(),
            0.7 * (3.3 * t).cos(),
            0.5 * (1.7 * t + 1.0).sin(),
        )
    };
    let (camera_stamps, gyro_stamps) = (stamps(600, 30.0), stamps(4100, 200.0));
    let camera: Vec<_> = (0..600)
        .map(|i| rotation * rate(i as f64 / 30.0) + noise(0.01))
        .collect();
    let gyro: Vec<_> = (0..4100)
        .map(|i| rate(i as f64 / 200.0 - offset) + bias + noise(2.5e-3))
        .collect();
    let found = camera_imu(&camera, &camera_stamps, &gyro, &gyro_stamps, 0.1).unwrap();
    assert_eq!(found.status, Status::Ok);
    assert!(
        (found.time_offset_s - offset).abs() < 5e-4,
        "{}",
        found.time_offset_s
    );
    assert!(found.camera_from_imu.angle_to(&rotation) < 2e-3);
    assert!((found.gyro_bias_rad_s - bias).norm() < 2e-3);
    // About one axis the rotation about it is unknown.
    let one = |v: &Vector3<f64>, axis: Vector3<f64>| axis * axis.dot(v);
    let axis = Vector3::z();
    let (camera, gyro): (Vec<_>, Vec<_>) = (
        camera.iter().map(|c| one(c, rotation * axis)).collect(),
        gyro.iter().map(|g| one(g, axis)).collect(),
    );
    let found = camera_imu(&camera, &camera_stamps, &gyro, &gyro_stamps, 0.1).unwrap();
    assert_eq!(
        found.status,
        Status::Weak(Reason::Unobservable { directions: 1 })
    );
}
