//! The magnetic field, the magnetometer and the velocity sensor: signs, frames, units and statistics.

use super::*;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use sphereflow_core::{Pose, Stamp, Twist};

/// Rounding of a handful of f64 operations on numbers near 10.
const ROUNDING: f64 = 1e-13;

fn sigma(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

fn field(dipole_count: usize, seed: u64) -> MagneticField {
    let parameters = MagneticFieldParameters {
        dipole_count,
        ..MagneticFieldParameters::default()
    };
    MagneticField::new(&parameters, seed).unwrap()
}

#[test]
fn magnetic_field_without_dipoles_points_north_and_down_with_the_stated_dip() {
    let parameters = MagneticFieldParameters {
        dipole_count: 0,
        dip_rad: 1.0,
        north_heading_rad: 0.3,
        ..MagneticFieldParameters::default()
    };
    let uniform = MagneticField::new(&parameters, 0)
        .unwrap()
        .at(&Vector3::new(1.0, 2.0, 3.0));
    assert!((uniform.x.hypot(uniform.z) - 20.0).abs() < ROUNDING * 10.0);
    assert!((uniform.x.atan2(uniform.z) - 0.3).abs() < ROUNDING);
    assert!(
        (uniform.y.atan2(20.0) - 1.0).abs() < ROUNDING,
        "dip is down, +y"
    );
}

#[test]
fn magnetic_field_of_a_dipole_has_no_divergence_and_no_curl_and_twice_the_strength_on_its_axis() {
    let field = field(1, 5);
    let dipole = field.dipoles()[0];
    let moment = dipole.moment_a_m2;
    let across = moment.cross(&Vector3::new(0.3, 0.5, -0.8)).normalize();
    let part = |p: Vector3<f64>| field.at(&(dipole.position_m + p)) - field.uniform_ut();
    // mu_0 / (4 pi) = 0.1 uT m^3 / (A m^2); at 2 m a factor 1/8.
    let on_axis = part(moment.normalize() * 2.0);
    assert!((on_axis - moment * (0.2 / 8.0)).norm() < 1e-12, "{on_axis}");
    assert!((part(across * 2.0) + moment * (0.1 / 8.0)).norm() < 1e-12);
    // Central differences of step 1e-4 m: error near 1e-7 of the gradient.
    let (h, at) = (1e-4, Vector3::new(0.7, -0.4, 0.5));
    let gradient = Matrix3::from_columns(&[0, 1, 2].map(|axis| {
        let step = Vector3::ith(axis, h);
        (part(at + step) - part(at - step)) / (2.0 * h)
    }));
    assert!(
        gradient.trace().abs() < 1e-5 * gradient.norm(),
        "{gradient}"
    );
    assert!((gradient - gradient.transpose()).norm() < 1e-5 * gradient.norm());
    // Twice the moment over the cube of the radius of 0.3 m, at most.
    assert!(
        part(Vector3::repeat(1e-9)).norm() < 0.201 / 0.027 * moment.norm(),
        "the field runs away"
    );
}

#[test]
fn magnetic_field_varies_indoors_and_depends_on_the_seed_alone() {
    assert_eq!(field(6, 1), field(6, 1));
    assert_ne!(field(6, 1), field(6, 2));
    let here = field(6, 1).at(&Vector3::new(0.5, 0.0, 0.0));
    let there = field(6, 1).at(&Vector3::new(-2.0, 0.5, 1.5));
    assert!((here - there).norm() > 0.1, "the field is uniform");
}

#[test]
fn magnetometer_reads_the_field_in_its_frame_through_iron_with_the_stated_noise() {
    let camera_from_mag = Pose::new(
        UnitQuaternion::from_euler_angles(0.2, 0.1, -0.4),
        Vector3::new(0.02, 0.0, 0.05),
    );
    let parameters = MagnetometerParameters {
        hard_iron_ut: Vector3::new(3.0, -8.0, 5.0),
        soft_iron: Matrix3::new(1.1, 0.05, 0.0, 0.02, 0.9, -0.03, 0.0, 0.01, 1.0),
        sigma_ut: 0.5,
        camera_from_mag,
    };
    let pose = Pose::new(
        UnitQuaternion::from_euler_angles(0.4, -0.6, 1.2),
        Vector3::new(0.9, -0.3, 0.4),
    );
    let field = field(3, 2);
    let mut sensor = Magnetometer::new(parameters, 4).unwrap();
    let ideal = sensor.ideal(&field, &pose);
    let undone = parameters.soft_iron.try_inverse().unwrap() * (ideal - parameters.hard_iron_ut);
    let world = (pose * camera_from_mag).rotation * undone;
    let truth = field.at(&(pose * camera_from_mag).translation);
    assert!((world - truth).norm() < 1e-12 * truth.norm().max(1.0) * 10.0);
    let mut errors = Vec::new();
    for k in 0..10_000 {
        let sample = sensor.sample(Stamp::from_ns(k), &field, &pose).unwrap();
        errors.extend((sample.mag_ut - ideal).iter());
    }
    // Four standard errors of 30 000 numbers.
    assert!(
        (sigma(&errors) / 0.5 - 1.0).abs() < 0.017,
        "{}",
        sigma(&errors)
    );
}

#[test]
fn magnetic_parameters_out_of_range_are_errors_that_name_them() {
    let text = |p: &MagneticFieldParameters| MagneticField::new(p, 0).unwrap_err().to_string();
    let default = MagneticFieldParameters::default();
    let dip = MagneticFieldParameters {
        dip_rad: 2.0,
        ..default
    };
    assert!(text(&dip).contains("dip_rad"));
    let corner = MagneticFieldParameters {
        box_max_m: Vector3::repeat(-9.0),
        ..default
    };
    assert!(text(&corner).contains("box_max_m"));
    let noise = MagnetometerParameters {
        sigma_ut: -1.0,
        ..MagnetometerParameters::default()
    };
    assert!(
        Magnetometer::new(noise, 0)
            .unwrap_err()
            .to_string()
            .contains("sigma_ut")
    );
    let iron = MagnetometerParameters {
        soft_iron: Matrix3::zeros(),
        ..MagnetometerParameters::default()
    };
    assert!(
        Magnetometer::new(iron, 0)
            .unwrap_err()
            .to_string()
            .contains("soft_iron")
    );
}

/// Thesis: section 5.4.3
#[test]
fn velocity_sensor_has_the_biases_and_the_noise_of_chapter_5() {
    let truth = Twist {
        angular_rad_s: Vector3::new(0.1, -0.2, 0.3),
        linear_m_s: Vector3::new(1.0, 0.5, -0.7),
    };
    let mut sensor = VelocitySensor::new(VelocityParameters::default(), 6).unwrap();
    let count = 20_000;
    let (mut angular, mut linear) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let read = sensor.sample(&truth).unwrap();
        angular.push(read.angular_rad_s - truth.angular_rad_s);
        linear.push(read.linear_m_s - truth.linear_m_s);
    }
    for (errors, bias, noise) in [(angular, 0.05, 0.005), (linear, 2.5, 0.05)] {
        let mean = errors.iter().sum::<Vector3<f64>>() / f64::from(count);
        // Four standard errors of a mean and of a deviation.
        let bound = 4.0 * noise / f64::from(count).sqrt();
        assert!(
            (mean - Vector3::new(bias, 0.0, 0.0)).amax() < bound,
            "bias {mean}"
        );
        let rest: Vec<f64> = errors.iter().flat_map(|e| (e - mean).data.0[0]).collect();
        assert!(
            (sigma(&rest) / noise - 1.0).abs() < 0.012,
            "{}",
            sigma(&rest)
        );
    }
    let negative = VelocityParameters {
        linear_sigma_m_s: -0.1,
        ..VelocityParameters::default()
    };
    let error = VelocitySensor::new(negative, 0).unwrap_err().to_string();
    assert!(error.contains("linear_sigma_m_s"), "{error}");
}
